#include "evaluate_map.hpp"

#ifdef PADE_HAS_SIMULATION

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "pade/evaluation/map/map_ceiling.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/offline/map_replay.hpp"
#include "pade/report/tables/map_accuracy_tables.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"
#include "pade/simulation/world/world_solids.hpp"

#include "options/json_text.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using evaluation::MapAccuracy;
using evaluation::MapMeasures;

/// Shorter steps have no direction.
constexpr double kShortestStep = 0.01;  // metres
/// The view ahead is asked from here on: before, the map has hardly begun.
constexpr std::size_t kFirstFrames = 5;
constexpr double kFarthestClearance = 10;  // metres

/// The world with everything that truth is taken from.
struct KnownWorld {
  simulation::Scene scene;
  evaluation::TrueWorld truth;
};

Result<KnownWorld> load_world(const EvaluateMapArguments& arguments) {
  auto world =
      simulation::read_sdf(arguments.world, {arguments.resources.begin(), arguments.resources.end()});
  if (!world) return world.error();
  auto scene = simulation::Scene::build(std::move(world).value());
  if (!scene) return Error{fmt::format("{}: {}", arguments.world, scene.error().message)};
  evaluation::Surface surface(simulation::surface_triangles(scene->world()));
  auto inside = [solids = simulation::WorldSolids(scene->world())](const Eigen::Vector3d& point) {
    return solids.inside(point);
  };
  return KnownWorld{std::move(scene).value(), {std::move(surface), std::move(inside)}};
}

/// A frame that has a pose in the run and a true one.
struct ComparedFrame {
  Time time;
  Pose T_map_camera;
  Pose T_world_camera;
  std::optional<Eigen::Vector3d> direction;  ///< of flight, camera coordinates; empty if it hardly moves
};

/// A run with its sequence as it truly was.
struct OpenRun {
  io::Run run;
  MapSequenceOptions options;
  io::Sequence sequence;  ///< with true poses
  std::vector<ComparedFrame> frames;
  std::size_t frames_with_pose = 0;
};

Result<MapSequenceOptions> options_of(const io::Run& run) {
  MapSequenceOptions options;
  const Status status = io::from_yaml(run.info.options, (run.folder / "run.json").string(), options);
  if (!status) return status.error();
  return options;
}

Result<std::vector<io::StampedPose>> poses_of(const io::Run& run) {
  io::ReadReport report;
  const auto trajectory = io::read_trajectory(run.folder / "trajectory.txt", report);
  if (!trajectory) return trajectory.error();
  return trajectory->rows();
}

std::vector<ComparedFrame> compared_frames(const std::vector<io::StampedPose>& used,
                                           const io::Sequence& truth) {
  std::map<Time, Pose> true_poses;
  for (std::size_t i = 0; i < truth.size(); ++i) true_poses.emplace(truth.time(i), truth.pose(i));
  std::vector<ComparedFrame> frames;
  for (const io::StampedPose& row : used) {
    const auto found = true_poses.find(row.time);
    if (found == true_poses.end()) continue;
    ComparedFrame frame{row.time, row.pose, found->second, {}};
    if (const auto next = std::next(found); next != true_poses.end()) {
      const Eigen::Vector3d step = next->second.translation - found->second.translation;
      if (step.norm() >= kShortestStep) frame.direction = found->second.rotation.conjugate() * step;
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

Result<OpenRun> open_run(const std::string& folder, const EvaluateMapArguments& arguments) {
  auto run = io::read_run(folder);
  if (!run) return run.error();
  auto options = options_of(*run);
  if (!options) return options.error();
  const fs::path source = arguments.sequence.empty() ? run->info.sequence : fs::path(arguments.sequence);
  io::SequenceOptions true_options = options->sequence;
  true_options.poses = "groundtruth";
  true_options.origin = "none";  // truth is compared in the coordinates of the world
  auto sequence = io::Sequence::open(source, true_options);
  if (!sequence) {
    return Error{
        fmt::format("{}: the true poses of its sequence are needed: {}", folder, sequence.error().message)};
  }
  const auto poses = poses_of(*run);
  if (!poses) return poses.error();
  std::vector<ComparedFrame> frames = compared_frames(*poses, *sequence);
  if (frames.empty()) {
    return Error{fmt::format("{}: none of its {} poses has the time of a frame of {} with a true pose",
                             folder, poses->size(), source.string())};
  }
  return OpenRun{std::move(run).value(), std::move(options).value(), std::move(sequence).value(),
                 std::move(frames), poses->size()};
}

evaluation::RigidAlignment alignment_of(const std::vector<ComparedFrame>& frames) {
  std::vector<Pose> map;
  std::vector<Pose> world;
  for (const ComparedFrame& frame : frames) {
    map.push_back(frame.T_map_camera);
    world.push_back(frame.T_world_camera);
  }
  return evaluation::align(map, world);
}

MapMeasures measures_of(const mapping::OccupancyMap& map, const evaluation::SeenSurface& seen,
                        const evaluation::PlacedSurface& surface) {
  const auto counts = map.counts();
  return {counts.occupied, counts.free, evaluation::surface_shares(map, seen.voxels(surface), surface),
          evaluation::phantoms(map, surface)};
}

/// The finished map, and OctoMap's with exact depth.
Status measure_maps(const OpenRun& run, const KnownWorld& world, const EvaluateMapArguments& arguments,
                    MapAccuracy& accuracy) {
  const fs::path map_file = run.run.folder / "map.ot";
  if (!run.run.has("map.ot"))
    return Error{fmt::format("{}: found no such file, expected the map", map_file.string())};
  const auto map = io::read_map(map_file, run.options.mapper.map);
  if (!map) return map.error();
  const Pose T_map_world = accuracy.alignment
                               ? accuracy.alignment->T_map_world
                               : Pose{Eigen::Quaterniond::Identity(), -run.run.info.local_origin};
  const evaluation::PlacedSurface in_map(world.truth.surface, T_map_world);
  const evaluation::PlacedSurface in_world(world.truth.surface);
  evaluation::SeenSurface seen(accuracy.voxel, accuracy.seen_depth);
  evaluation::SeenSurface seen_in_world(accuracy.voxel, accuracy.seen_depth);
  auto ceiling = evaluation::MapCeiling::create(map->options());
  if (!ceiling) return ceiling.error();

  const Camera& camera = run.sequence.camera();
  const simulation::RayGrid grid(camera);
  accuracy.clearance = kFarthestClearance;
  Progress progress("Comparing", run.frames.size());
  for (const ComparedFrame& frame : run.frames) {
    const cv::Mat depth = exact_depth(world.scene, grid, frame.T_world_camera);
    const Pose T_map_camera = T_map_world * frame.T_world_camera;
    accuracy.clearance =
        std::min(accuracy.clearance, in_world.distance(frame.T_world_camera.translation, accuracy.clearance));
    seen.add(depth, camera, T_map_camera);
    if (frame.direction)
      accuracy.ahead += evaluation::ahead_shares(*map, depth, camera, T_map_camera, *frame.direction);
    if (arguments.ceiling) {
      seen_in_world.add(depth, camera, frame.T_world_camera);
      ceiling->add(depth, camera, frame.T_world_camera);
    }
    progress.step();
    if (io::interrupted()) return io::interrupted_error();
  }
  accuracy.map = measures_of(*map, seen, in_map);
  if (!arguments.ceiling) return {};
  const auto best = ceiling->finish();
  if (!best) return best.error();
  accuracy.ceiling = measures_of(*best, seen_in_world, in_world);
  return {};
}

/// What the map knew after each frame.
Result<evaluation::ViewAheadResult> replay(const OpenRun& run, const KnownWorld& world) {
  const auto sequence = open_sequence(run.sequence.folder(), run.options);
  if (!sequence) return sequence.error();
  std::map<Time, const ComparedFrame*> frames;
  for (const ComparedFrame& frame : run.frames) frames.emplace(frame.time, &frame);
  const simulation::RayGrid grid(sequence->camera());
  evaluation::ViewAhead ahead(world.truth);
  std::size_t done = 0;
  Progress progress("Mapping again", sequence->size());
  const auto mapper =
      replay_map(*sequence, run.options, {}, [&](const Frame& frame, const ObstacleMapper& now) {
        progress.step();
        const auto found = frames.find(frame.time);
        if (++done > kFirstFrames && found != frames.end() && found->second->direction) {
          const ComparedFrame& truth = *found->second;
          const cv::Mat depth = exact_depth(world.scene, grid, truth.T_world_camera);
          ahead.add(now.map(), frame.T_world_camera, truth.T_world_camera, *truth.direction, depth,
                    now.camera());
        }
        return !io::interrupted();
      });
  if (!mapper) return mapper.error();
  return ahead.result();
}

/// The occupied voxels of another run over the frames that have a pose in this one.
Result<MapAccuracy::Reference> reference_of(const OpenRun& run, const std::string& folder) {
  const auto other = io::read_run(folder);
  if (!other) return other.error();
  const auto options = options_of(*other);
  if (!options) return options.error();
  const auto poses = poses_of(*other);
  if (!poses) return poses.error();
  std::set<Time> known;
  for (const ComparedFrame& frame : run.frames) known.insert(frame.time);
  MapAccuracy::Reference reference;
  reference.run = folder;
  for (const io::StampedPose& row : *poses) reference.frames += known.contains(row.time) ? 1 : 0;
  if (reference.frames == 0)
    return Error{fmt::format("{}: found no frame of {}", folder, run.run.folder.string())};
  if (reference.frames == poses->size() && other->info.map) {
    reference.occupied = other->info.map->occupied_voxels;
    return reference;
  }
  const auto sequence = open_sequence(other->info.sequence, *options);
  if (!sequence) return sequence.error();
  Progress progress("Mapping the reference", reference.frames);
  const auto mapper = replay_map(
      *sequence, *options, [&](Time time) { return known.contains(time); },
      [&](const Frame&, const ObstacleMapper&) {
        progress.step();
        return !io::interrupted();
      });
  if (!mapper) return mapper.error();
  reference.occupied = mapper->map().counts().occupied;
  return reference;
}

Result<MapAccuracy> accuracy_of(const std::string& folder, const KnownWorld& world,
                                const EvaluateMapArguments& arguments) {
  const auto run = open_run(folder, arguments);
  if (!run) return run.error();
  MapAccuracy accuracy;
  accuracy.frames = static_cast<std::size_t>(run->run.info.health.frames);
  accuracy.frames_with_pose = run->frames_with_pose;
  accuracy.frames_compared = run->frames.size();
  accuracy.voxel = run->options.mapper.map.voxel;
  accuracy.range = run->options.mapper.map.range;
  if (arguments.align) accuracy.alignment = alignment_of(run->frames);
  if (!arguments.reference.empty()) {
    auto reference = reference_of(*run, arguments.reference);
    if (!reference) return reference.error();
    accuracy.reference = std::move(reference).value();
  }
  if (Status status = measure_maps(*run, world, arguments, accuracy); !status) return status.error();
  if (arguments.replay) {
    auto replayed = replay(*run, world);
    if (!replayed) return replayed.error();
    accuracy.replayed = std::move(replayed).value();
  }
  return accuracy;
}

}  // namespace

Status evaluate_maps(const EvaluateMapArguments& arguments) {
  cv::setNumThreads(1);  // as `pade map`
  const auto world = load_world(arguments);
  if (!world) return world.error();
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const std::string& run : arguments.runs) {
    const auto accuracy = accuracy_of(run, *world, arguments);
    if (!accuracy) return accuracy.error();
    if (arguments.json) {
      nlohmann::ordered_json json = {{"run", run}, {"world", arguments.world}};
      json.update(json_of(*accuracy));
      all.push_back(std::move(json));
    } else {
      fmt::print("{}{} in {}\n{}", &run == arguments.runs.data() ? "" : "\n\n", run, arguments.world,
                 to_table(*accuracy));
    }
  }
  if (arguments.json) fmt::print("{}\n", json_text(all.size() == 1 ? all[0] : all));
  return {};
}

}  // namespace pade::cli

#else

#include <string_view>

#include <fmt/format.h>

namespace pade::cli {

Status evaluate_maps(const EvaluateMapArguments&) {
  return Error{fmt::format("--world needs the simulator, which this build has not: {}",
                           std::string_view(PADE_SIMULATION_MISSING).empty()
                               ? "it was configured with -DPADE_BUILD_SIMULATION=OFF"
                               : "missing were " PADE_SIMULATION_MISSING
                                 "; install them, then configure and build again")};
}

}  // namespace pade::cli

#endif
