// The layout of ICL-NUIM in its "TUM RGB-D compatible" form: rgb/N.png, depth/N.png and
// livingRoom2.gt.freiburg or traj0.gt.freiburg, whose rows begin with N in place of a time. Its world and its
// camera are left-handed, as those of the renderer: x right, y up, z forward.
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

constexpr double kRate = 30;  // frames per second
constexpr std::string_view kEnding = ".gt.freiburg";

Time time_of(double frame) { return Time::from_seconds(frame / kRate); }

/// The trajectory in the folder; the first by name.
fs::path pose_file(const fs::path& folder) {
  fs::path found;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    if (!entry->path().filename().string().ends_with(kEnding)) continue;
    if (found.empty() || entry->path() < found) found = entry->path();
  }
  return found;
}

std::vector<StampedFile> numbered_frames(const std::vector<fs::path>& files, ReadReport& report) {
  std::vector<StampedFile> out;
  for (const fs::path& file : files) {
    const std::string stem = file.stem().string();
    int frame = 0;
    const auto [stop, status] = std::from_chars(stem.data(), stem.data() + stem.size(), frame);
    if (status != std::errc{} || stop != stem.data() + stem.size() || frame < 0) {
      report.skip(file.string(),
                  fmt::format("found name {}, expected the number of a frame", in_quotes(stem)));
      continue;
    }
    out.push_back({time_of(frame), file});
  }
  std::sort(out.begin(), out.end(),
            [](const StampedFile& a, const StampedFile& b) { return a.time < b.time; });
  return out;
}

/// Frame numbers become times, and both frames are turned right-handed by their y: with S = diag(1, -1, 1)
/// the pose S T S, whose camera is x right, y down, z forward.
Trajectory right_handed(const Trajectory& trajectory) {
  std::vector<StampedPose> rows;
  for (const StampedPose& row : trajectory.rows()) {
    const Eigen::Quaterniond& q = row.pose.rotation;
    const Eigen::Vector3d& t = row.pose.translation;
    rows.push_back({time_of(row.time.seconds()), Pose{Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z()),
                                                      Eigen::Vector3d(t.x(), -t.y(), t.z())}});
  }
  return Trajectory(std::move(rows));
}

Calibration published() {
  Calibration calibration;
  calibration.format = "ICL-NUIM";
  // The published fy is negative, which the turned y makes positive.
  calibration.camera = Camera{640, 480, 481.2, 480, 319.5, 239.5, Distortion::none, {}};
  calibration.depth_scale = 5000;
  return calibration;
}

}  // namespace

bool is_icl_nuim_layout(const fs::path& folder) {
  return path_exists(folder / "rgb") && !path_exists(folder / "groundtruth.txt") &&
         !pose_file(folder).empty();
}

Result<SequenceListing> read_icl_nuim_layout(const fs::path& folder, const LayoutChoice& choice,
                                             ReadReport& report) {
  SequenceListing listing;
  listing.layout = "ICL-NUIM";
  auto calibration = with_overrides(published(), folder, choice, report);
  if (!calibration) return calibration.error();
  listing.calibration = std::move(*calibration);
  listing.images = numbered_frames(image_files(folder / "rgb"), report);
  listing.depth_folder = folder / "depth";
  listing.depth = numbered_frames(image_files(listing.depth_folder), report);
  if (choice.computed) return listing;
  if (choice.poses == "original") {
    return Error{
        fmt::format("{}: the ICL-NUIM layout has no original poses, expected groundtruth or a pose file",
                    folder.string())};
  }
  const bool own = choice.poses == "groundtruth";
  listing.pose_file = own ? pose_file(folder) : fs::path(choice.poses);
  std::vector<Time> times;
  for (const StampedFile& image : listing.images) times.push_back(image.time);
  auto trajectory = read_any_poses(listing.pose_file, times, report);
  if (!trajectory) return trajectory.error();
  listing.trajectory = own ? right_handed(*trajectory) : std::move(*trajectory);
  listing.poses_of_body = listing.calibration.pose_convention == PoseConvention::body_to_world;
  if (own) {
    listing.world_up = WorldUp{-Eigen::Vector3d::UnitY(), true, "ICL-NUIM layout"};
    report.notes.push_back(
        fmt::format("{}: its frames are left-handed (y up): y is turned round in camera and world, and frame "
                    "numbers are read as "
                    "30 per second",
                    listing.pose_file.string()));
  }
  return listing;
}

}  // namespace pade::io
