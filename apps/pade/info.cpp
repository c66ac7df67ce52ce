// `pade info`: what is in a sequence, a map or a run, and whether it is sane.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/checks/scene_hardness.hpp"
#include "pade/checks/sequence_check.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/foreign_file.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/live/recordings/tlog.hpp"
#include "pade/live/recordings/ulog.hpp"
#include "pade/report/run_evaluation.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

#include "commands.hpp"
#include "info/calibration_info.hpp"
#include "info/info_lines.hpp"
#include "info/map_info.hpp"
#include "info/map_questions.hpp"
#include "info/recording_info.hpp"
#include "info/sequence_set.hpp"
#include "options/json_text.hpp"
#include "options/unused_options.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using cli::json_of;
using evaluation::PoseCheck;
using evaluation::SceneHardness;
using evaluation::SequenceCheck;
using evaluation::Spread;

constexpr double kDegrees = 180 / std::numbers::pi;

struct InfoArguments {
  std::string path;
  std::string poses = "groundtruth";
  std::string world_up;
  std::string calibration;
  std::string topics;
  MapQuestions questions;
  int camera = 0;
  int step = 1;
  bool json = false;
  const CLI::App* command = nullptr;
};

// "-y" where the direction is an axis.
std::string direction_text(const Eigen::Vector3d& direction) {
  int axis = 0;
  if (direction.cwiseAbs().maxCoeff(&axis) < 0.9999) return vector_text(direction);
  return fmt::format("{}{}", direction[axis] < 0 ? '-' : '+', "xyz"[axis]);
}

Json json_of(const Spread& spread) {
  return {{"least", spread.least}, {"median", spread.median}, {"most", spread.most}};
}
Json json_of(const io::GeographicOrigin& origin) {
  return {{"latitude_deg", origin.latitude_deg},
          {"longitude_deg", origin.longitude_deg},
          {"height_m", origin.height}};
}

std::string_view verdict_name(PoseCheck::Verdict verdict) {
  return verdict == PoseCheck::Verdict::good    ? "good"
         : verdict == PoseCheck::Verdict::wrong ? "wrong"
                                                : "unclear";
}

Json json_of(const PoseCheck& check) {
  Json scores = Json::array();
  for (const auto& score : check.scores) {
    scores.push_back({{"convention", name_of(score.convention)},
                      {"error", score.error},
                      {"positive_depth", score.positive_depth},
                      {"wins", score.wins}});
  }
  return {{"verdict", verdict_name(check.verdict)},
          {"best", name_of(check.best)},
          {"says", check.sentence},
          {"measure", check.photometric ? "grey levels" : "pixels from the epipolar line"},
          {"pairs", check.pairs},
          {"without_motion", check.without_motion},
          {"conventions", std::move(scores)}};
}

Json json_of(const io::Sequence& sequence, const SequenceCheck& check) {
  const Camera& camera = sequence.camera();
  Json json = {{"kind", "sequence"},
               {"folder", sequence.folder().string()},
               {"layout", sequence.layout()},
               {"frames", sequence.listed_frames()},
               {"frames_usable", sequence.size()},
               {"width", camera.width},
               {"height", camera.height},
               {"fx", camera.fx},
               {"fy", camera.fy},
               {"cx", camera.cx},
               {"cy", camera.cy},
               {"pose_file", sequence.pose_file().string()},
               {"step", check.step},
               {"duration_s", check.duration},
               {"gap_s", json_of(check.gap)},
               {"baseline_m", json_of(check.baseline)},
               {"rotation_rad", json_of(check.rotation)},
               {"forward_share", check.forward_share},
               {"parallax_at_5_m_px", check.parallax_at_5_metres},
               {"parallax_px", nullptr},
               {"truth", nullptr},
               {"world_up", nullptr},
               {"geographic_origin", nullptr},
               {"local_origin_m", json_of(sequence.local_origin())},
               {"poses", json_of(check.poses)},
               {"warnings", check.warnings},
               {"notes", sequence.notes()},
               {"skipped", Json::array()}};
  if (check.parallax) json["parallax_px"] = *check.parallax;
  if (check.truth_depth)
    json["truth"] = {{"coverage", *check.truth_coverage}, {"depth_m", json_of(*check.truth_depth)}};
  if (const auto& up = sequence.world_up())
    json["world_up"] = {{"direction", json_of(up->direction)}, {"stated", up->stated}};
  if (const auto& origin = sequence.origin()) json["geographic_origin"] = json_of(*origin);
  for (const io::Skipped& item : sequence.skipped())
    json["skipped"].push_back({{"file", item.file}, {"reason", item.reason}});
  return json;
}

void print_poses(const PoseCheck& check) {
  line("convention", "{}", check.sentence);
  if (check.scores.empty()) return;
  line("", "error in {}, median of {} pairs (camera at rest: {:.1f}):",
       check.photometric ? "grey levels" : "px from the epipolar line", check.pairs, check.without_motion);
  for (const auto& score : check.scores) {
    const std::string depth =
        check.photometric ? "" : fmt::format("   {:3.0f} % of tracks in front", 100 * score.positive_depth);
    line("", "  {:<17} {:5.1f}{}{}", name_of(score.convention), score.error, depth,
         score.convention == check.best ? "   <- best" : "");
  }
}

void print_sequence(const io::Sequence& sequence, const SequenceCheck& check) {
  const Camera& camera = sequence.camera();
  const std::string per = check.step == 1 ? "per frame" : fmt::format("per {} frames", check.step);
  fmt::print("{}: {} sequence, {} of {} frames usable\n", sequence.folder().string(), sequence.layout(),
             sequence.size(), sequence.listed_frames());
  line("camera", "{} x {}, f = {:.2f} {:.2f}, c = {:.2f} {:.2f}{}", camera.width, camera.height, camera.fx,
       camera.fy, camera.cx, camera.cy, sequence.raw_camera().is_pinhole() ? "" : " (distortion is removed)");
  line("time", "{:.3f} s, {:.2f} frames/s, gaps {:.3f} to {:.3f} s", check.duration,
       check.gap.median > 0 ? 1 / check.gap.median : 0, check.gap.least, check.gap.most);
  line("poses", "{}, {} rows", sequence.pose_file().filename().string(), sequence.trajectory().size());
  line("baseline", "median {:.3f} m {} ({:.3f} to {:.3f}), {:.0f} % of it forward", check.baseline.median,
       per, check.baseline.least, check.baseline.most, 100 * check.forward_share);
  line("rotation", "median {:.2f} deg {}, at most {:.2f}", check.rotation.median * kDegrees, per,
       check.rotation.most * kDegrees);
  if (check.parallax) line("parallax", "median {:.1f} px {} (from true depth)", *check.parallax, per);
  line(check.parallax ? "" : "parallax", "{:.1f} px {} for things 5 m away", check.parallax_at_5_metres, per);
  if (check.truth_depth) {
    line("true depth", "on {:.0f} % of the pixels, {:.1f} to {:.1f} m", 100 * *check.truth_coverage,
         check.truth_depth->least, check.truth_depth->most);
  }
  if (const auto& up = sequence.world_up()) {
    line("up", "{} ({}{})", direction_text(up->direction),
         up->stated ? std::string("stated") : "guessed from " + up->source,
         check.up_disagreement
             ? fmt::format("; cameras' mean up {:.0f} deg from it", *check.up_disagreement * kDegrees)
             : "");
  }
  if (const auto& origin = sequence.origin()) {
    line("origin", "latitude {:.7f}, longitude {:.7f}, height {:.2f} m", origin->latitude_deg,
         origin->longitude_deg, origin->height);
  }
  print_poses(check.poses);
  for (const std::string& warning : check.warnings) line("warning", "{}", warning);
  for (const std::string& note : sequence.notes()) line("note", "{}", note);
  for (const io::Skipped& item : sequence.skipped()) line("skipped", "{}: {}", item.file, item.reason);
}

/// Refuses what does nothing for `what`.
Status used_alone(const InfoArguments& arguments, const std::vector<std::string>& used, const char* what) {
  return refuse_unused(*arguments.command, used, what);
}

Status inform_of_sequence(const InfoArguments& arguments) {
  io::SequenceOptions options;
  options.poses = arguments.poses;
  options.world_up = arguments.world_up;
  options.calibration = arguments.calibration;
  options.camera = arguments.camera;
  options.topics = arguments.topics;
  const Result<io::Sequence> sequence = io::Sequence::open(arguments.path, options);
  if (!sequence) {
    if (io::is_recording(arguments.path)) return sequence.error();
    const std::vector<FoundSequence> below = sequences_in(arguments.path, options);
    const bool any =
        std::any_of(below.begin(), below.end(), [](const auto& one) { return one.sequence.ok(); });
    if (!any) return sequence.error();
    const Status used = used_alone(
        arguments, {"--poses", "--world-up", "--calibration", "--camera", "--json"}, "a folder of sequences");
    return used ? inform_of_set(arguments.path, below, arguments.json) : used;
  }
  const Status used = used_alone(
      arguments, {"--poses", "--world-up", "--calibration", "--camera", "--topics", "--step", "--json"},
      "a sequence");
  if (!used) return used;
  const Result<SequenceCheck> check = evaluation::check_sequence(*sequence, arguments.step);
  if (!check) return check.error();
  std::optional<SceneHardness> hardness;
  if (sequence->has_truth()) {
    if (auto found = evaluation::scene_hardness(*sequence)) hardness = *found;
  }
  if (arguments.json) {
    Json json = json_of(*sequence, *check);
    json["scene"] = hardness ? json_of(*hardness) : Json();
    fmt::print("{}\n", json_text(json));
    return {};
  }
  print_sequence(*sequence, *check);
  if (hardness) print_hardness(*hardness);
  return {};
}

void print_timing(const io::RunTiming& timing) {
  if (timing.stages.empty()) return;
  fmt::print("  {:<12} {:>9} {:>9} {:>9} {:>9}\n", "time, ms", "median", "99 %", "largest", "mean");
  for (const io::StageTiming& stage : timing.stages) {
    fmt::print("  {:<12} {:>9.2f} {:>9.2f} {:>9.2f} {:>9.2f}\n", stage.stage, stage.p50, stage.p99, stage.max,
               stage.mean);
  }
  line("", "{:.1f} frames/s, peak memory {:.0f} MB", timing.frames_per_second,
       static_cast<double>(timing.peak_memory) / 1e6);
}

void print_run(const io::Run& run, const std::optional<evaluation::DepthAccuracy>& accuracy) {
  const io::RunInfo& info = run.info;
  fmt::print("{}: run of pade {} on {}\n", run.folder.string(), info.version, info.sequence.string());
  line("frames", "{} of {} used, {} depth images of {} x {}, poses {}", info.health.frames_used,
       info.health.frames, info.health.depth_images, info.camera.width, info.camera.height, info.poses);
  line("options", "{}", info.options);
  if (info.world_up) line("up", "{} ({})", direction_text(info.world_up->direction), info.world_up->source);
  if (info.origin)
    line("origin", "latitude {:.7f}, longitude {:.7f}, height {:.2f} m", info.origin->latitude_deg,
         info.origin->longitude_deg, info.origin->height);
  if (!info.local_origin.isZero(0))
    line("local origin", "{} {} {}: add it to get back to the coordinates of the poses",
         info.local_origin.x(), info.local_origin.y(), info.local_origin.z());
  if (info.map)
    line("map", "{} occupied and {} free voxels of {:g} m", info.map->occupied_voxels, info.map->free_voxels,
         info.map->voxel);
  double total = 0;
  for (const auto pixels : info.state_pixels) total += static_cast<double>(pixels);
  for (std::size_t i = 0; i < info.state_pixels.size() && total > 0; ++i) {
    line(i == 0 ? "pixels" : "", "{:5.1f} % {}", 100 * static_cast<double>(info.state_pixels[i]) / total,
         depth_state_names[i]);
  }
  for (const std::string& stack : info.stacks) line("images", "{}/", stack);
  for (const Hint& hint : info.hints) line(to_name(hint.severity), "{} ({})", hint.message, hint.advice);
  for (const std::string& warning : info.health.warnings) line("warning", "{}", warning);
  for (const io::Skipped& item : info.health.skipped) line("skipped", "{}: {}", item.file, item.reason);
  print_timing(run.timing);
  if (accuracy) fmt::print("\n{}", evaluation::to_table(*accuracy));
}

Status inform_of_run(const InfoArguments& arguments) {
  if (Status used = used_alone(arguments, {"--json"}, "a run"); !used) return used;
  const Result<io::Run> run = io::read_run(arguments.path);
  if (!run) return run.error();
  const Result<std::optional<evaluation::DepthAccuracy>> accuracy = evaluation::stored_accuracy(*run);
  if (!accuracy) return accuracy.error();
  if (!arguments.json) {
    print_run(*run, *accuracy);
    return {};
  }
  Json json = {{"kind", "run"},
               {"folder", arguments.path},
               {"run", io::json_of(run->info)},
               {"timing", io::json_of(run->timing)},
               {"evaluation", nullptr}};
  if (*accuracy) json["evaluation"] = evaluation::json_of(**accuracy);
  fmt::print("{}\n", json_text(json));
  return {};
}

Status inform(const InfoArguments& arguments) {
  const fs::path path = arguments.path;
  std::error_code code;
  if (!fs::exists(path, code)) {
    return Error{
        fmt::format("{}: found nothing there, expected a sequence, a map (.bt, .ot), a calibration, a "
                    "recording (.bag, .mcap, .db3, .tlog, .ulg) or a run",
                    arguments.path)};
  }
  if (io::is_recording(path)) {
    const Status used = used_alone(
        arguments, {"--poses", "--world-up", "--calibration", "--camera", "--topics", "--step", "--json"},
        "a recording");
    if (!used) return used;
    const auto images = inform_of_ros_recording(path, arguments.topics, arguments.json);
    if (!images) return images.error();
    return *images ? inform_of_sequence(arguments) : Status();
  }
  const bool sequence = fs::is_directory(path, code) && !fs::exists(path / "run.json", code);
  if (!arguments.topics.empty() && !sequence) {
    return Error{
        fmt::format("{}: is no recording of ROS, expected one since topics are named", arguments.path)};
  }
  if (!fs::is_directory(path, code)) {
    const bool log = live::is_tlog(path) || live::is_ulog(path);
    const Status used = log ? used_alone(arguments, {"--json"}, "an autopilot's log") : Status();
    if (!used) return used;
    if (live::is_tlog(path)) return inform_of_tlog(path, arguments.json);
    if (live::is_ulog(path)) return inform_of_ulog(path, arguments.json);
    if (const std::string advice = io::advice_for(path); !advice.empty())
      return Error{fmt::format("{}: cannot be read as what its name says{}", arguments.path, advice)};
    const bool map = path.extension() == ".bt" || path.extension() == ".ot";
    if (map) return inform_of_map(path, arguments.questions, *arguments.command, arguments.json);
    const Status fits = used_alone(arguments, {"--camera", "--json"}, "a calibration");
    return fits ? inform_of_calibration(path, arguments.camera, arguments.json) : fits;
  }
  if (!fs::exists(path / "run.json", code)) return inform_of_sequence(arguments);
  if (!asks_of_map(*arguments.command)) return inform_of_run(arguments);
  return inform_of_map(io::map_file_of(path), arguments.questions, *arguments.command, arguments.json);
}

}  // namespace

void add_info(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command =
      app.add_subcommand("info", "Say what is in a sequence, a map or a run, and whether it is sane.");
  arguments->command = command;
  command->footer(
      "Of a sequence: gaps in time, motion and parallax, which way is up, and whether the poses are in the "
      "convention\n"
      "that pade expects (camera to world; camera x right, y down, z forward), tried on the images "
      "themselves.\n\n"
      "  pade info flight/          before mapping it\n"
      "  pade info flights/         a folder of sequences: how hard the scene of each is, and of all\n"
      "  pade info out/flight       how a run went\n"
      "  pade info out/flight/map.bt\n"
      "  pade info out/flight --at 5 0 1                 of a place: free? how far from what is not?\n"
      "  pade info out/flight --ray 0 0 1 1 0 0 --reach 10 --unknown free      what the ray meets first\n"
      "  pade info out/flight --box 4 -1 0 6 1 2         what is in it\n"
      "  pade info out/flight --ball 5 0 1 0.5           likewise\n"
      "  pade info out/flight --sweep 0 0 1 4 0 1 6 2 1 --radius 0.45     what a vehicle on its way meets "
      "first\n"
      "  pade info out/flight --frontiers                where what is known ends\n"
      "  pade info camchain.yaml --camera 1     what is understood of a calibration\n"
      "  pade info flight.tlog      messages, and whether the sensors in them will do\n"
      "  pade info flight.bag       topics, and whether they make a flight\n");
  command
      ->add_option(
          "PATH", arguments->path,
          "Sequence, folder of sequences, recording (.bag, .mcap, .db3, .tlog, .ulg), map (.bt, .ot), "
          "calibration or run")
      ->required();
  command->add_option("--poses", arguments->poses, "groundtruth, original or a pose file")
      ->capture_default_str();
  command->add_option("--world-up", arguments->world_up,
                      "Axis of the pose world that points up: +x -x +y -y +z -z");
  command->add_option("--calibration", arguments->calibration,
                      "Calibration file instead of the sequence's own (docs/formats.md)");
  command
      ->add_option("--camera", arguments->camera,
                   "Which camera of a calibration file that holds several, from 0")
      ->check(CLI::Range(0, 99));
  command->add_option("--topics", arguments->topics,
                      "Topics of a recording that are meant where several fit, separated by blanks");
  command->add_option("--step", arguments->step, "Look at each frame and the k-th before it")
      ->capture_default_str();
  add_options(*command, arguments->questions);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments, &context] {
    const Status status = inform(*arguments);
    if (status) return;
    fmt::print(stderr, "pade info: {}\n", status.error().message);
    context.exit_code = 1;
  });
}

}  // namespace pade::cli
