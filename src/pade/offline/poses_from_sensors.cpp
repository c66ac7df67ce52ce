#include "pade/offline/poses_from_sensors.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "pade/offline/camera/camera_feedback.hpp"
#include "pade/offline/checked_log.hpp"

namespace pade {
namespace {

/// What became of the images in the filter.
std::vector<std::string> notes_on(const CameraFeedback& feedback, const NavigationRun& run) {
  const OdometerTally& seen = feedback.tally();
  const navigation::CameraTally& used = run.camera;
  std::vector<std::string> notes;
  notes.push_back(fmt::format(
      "the camera is fed back: of {} pairs of images {} gave a motion ({} before the filter knew a "
      "direction), "
      "{} had no parallax, {} too few pixels, {} contradicted what was known; the filter used {} with "
      "their direction and {} for the rotation alone, and refused {}",
      seen.pairs, seen.measured, seen.searched, seen.still, seen.blank, seen.refused, used.used,
      used.rotation_only, used.refused));
  constexpr double kDegree = 0.017453292519943295;
  notes.push_back(fmt::format("the camera's mounting is {:.2f} degrees from its calibration, by the filter",
                              rotation_log(run.camera_mounting).norm() / kDegree));
  if (feedback.unreadable() > 0)
    notes.push_back(fmt::format("{} images could not be read for it", feedback.unreadable()));
  return notes;
}

}  // namespace

Result<CameraTrajectory> camera_trajectory_from_imu_gnss(const std::filesystem::path& folder,
                                                         const std::vector<Time>& frames,
                                                         const CameraMounting& mounting,
                                                         const navigation::NavigatorOptions& options,
                                                         const std::string& topics, const FedImages* images) {
  io::NavigationLogOptions log_options;
  log_options.topics = topics;
  const auto checked = read_checked_log(folder, log_options);
  if (!checked) return checked.error();
  const NavigationLog* const log = &checked->log;
  if (log->gnss.velocities.empty() || log->gnss.fixes.empty()) {
    return Error{
        fmt::format("{}: no GNSS positions and velocities found, expected them in gnss.csv or the recording",
                    folder.string())};
  }
  NavigationRunOptions run_options;
  run_options.navigator = options;
  run_options.navigator.camera_time_offset = mounting.time_offset.value_or(options.camera_time_offset);
  run_options.navigator.gnss_lever_arm =
      mounting.gnss_lever_arm.value_or(log->gnss.lever_arm.value_or(options.gnss_lever_arm));
  run_options.frames = frames;
  run_options.T_body_camera = mounting.T_body_camera;
  std::optional<CameraFeedback> feedback;
  if (images != nullptr && options.filter.camera) {
    feedback.emplace(images->sequence, images->refinement, *log, mounting.T_body_camera,
                     run_options.navigator.camera_time_offset);
    run_options.camera = std::ref(*feedback);
  }
  const NavigationRun run = run_navigation(*log, run_options);

  CameraTrajectory trajectory = camera_trajectory(run, mounting.T_body_camera);
  trajectory.origin = log->gnss.origin;
  trajectory.hints = all_hints(*checked, run);
  if (feedback) trajectory.notes = notes_on(*feedback, run);
  if (trajectory.times.empty()) return never_aligned(folder.string(), *checked, run);
  return trajectory;
}

std::vector<std::string> notes_on(const CameraTrajectory& trajectory) {
  std::vector<std::string> notes = trajectory.notes;
  for (const Hint& hint : trajectory.hints)
    notes.push_back(fmt::format("{} -> {}", hint.message, hint.advice));
  const auto motions = trajectory.motions.size();
  const auto false_of = [](const std::vector<bool>& flags) {
    return std::count(flags.begin(), flags.end(), false);
  };
  if (const auto doubtful = false_of(trajectory.scale_valid); doubtful > 0) {
    notes.push_back(
        fmt::format("{} of {} motions between frames are too short for what the filter knows of their length "
                    "(scale_valid false)",
                    doubtful, motions));
  }
  if (const auto doubtful = false_of(trajectory.direction_valid); doubtful > 0) {
    notes.push_back(
        fmt::format("{} of {} motions between frames have a direction that the filter hardly knows "
                    "(direction_valid false)",
                    doubtful, motions));
  }
  if (trajectory.frames_left > 0) {
    notes.push_back(fmt::format(
        "the filter had to start anew: {} frames with a pose of their own are left out, the {} of the "
        "longest unbroken chain are kept",
        trajectory.frames_left, trajectory.times.size()));
  }
  return notes;
}

io::PoseSource poses_from_imu_gnss(const navigation::NavigatorOptions& options, const std::string& topics,
                                   const FedImages* images) {
  return [options, topics, images](const std::filesystem::path& folder, const std::vector<Time>& times,
                                   const io::Calibration& calibration) -> Result<io::ComputedPoses> {
    if (!calibration.T_body_camera) {
      return Error{
          fmt::format("{}: field T_body_camera is missing in the calibration, expected it because the poses "
                      "come from the "
                      "body's sensors",
                      folder.string())};
    }
    const CameraMounting mounting{*calibration.T_body_camera, calibration.time_offset_s,
                                  calibration.gnss_lever_arm};
    const auto trajectory = camera_trajectory_from_imu_gnss(folder, times, mounting, options, topics, images);
    if (!trajectory) return trajectory.error();
    io::ComputedPoses result;
    for (std::size_t i = 0; i < trajectory->times.size(); ++i) {
      result.poses.push_back({trajectory->times[i], trajectory->poses[i]});
      result.covariances.push_back(i > 0 ? trajectory->motions[i - 1].covariance : Matrix6d::Zero());
    }
    result.motions_without_scale = static_cast<std::size_t>(
        std::count(trajectory->scale_valid.begin(), trajectory->scale_valid.end(), false));
    result.navigation = trajectory->health;
    result.notes = notes_on(*trajectory);
    return result;
  };
}

}  // namespace pade
