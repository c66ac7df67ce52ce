#include "pade/offline/poses_from_sensors.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

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

/// Seconds with as many digits as they have, up to microseconds.
std::string seconds_text(double seconds) { return fmt::format("{:.6f} s", seconds); }

/// A sentence on the clocks; empty where both are one, as far as anybody says.
std::string note_on_clocks(const SensorSource& source, const std::optional<double>& calibrated) {
  constexpr const char* kMeaning = "time of a pose = time of the image";
  if (source.time_offset) {
    const std::string unused =
        calibrated && *calibrated != *source.time_offset
            ? fmt::format("; the calibration's {} is not used", seconds_text(*calibrated))
            : std::string();
    return fmt::format("{} + {}, {}{}", kMeaning, seconds_text(*source.time_offset),
                       source.found.empty() ? "as was given" : source.found, unused);
  }
  if (calibrated && (*calibrated != 0 || !source.log.empty()))
    return fmt::format("{} + {}, as the calibration says", kMeaning, seconds_text(*calibrated));
  return {};
}

/// The log on the clock of the images: offsets between clocks may be as long as the years since 1970.
void put_on_image_clock(NavigationLog& log, double offset) {
  const std::int64_t shift = Time::from_seconds(offset).nanoseconds;
  const auto move = [&](auto& items) {
    for (auto& item : items) item.time.nanoseconds -= shift;
  };
  move(log.imu);
  move(log.gnss.fixes);
  move(log.gnss.velocities);
  move(log.barometer);
  move(log.magnetometer);
  move(log.truth);
}

/// Refuses images and sensors that have no time in common.
Status check_overlap(const std::string& name, const NavigationLog& log, const std::vector<Time>& images,
                     double offset) {
  if (log.imu.empty() || images.empty()) return {};
  const double begin = seconds_between(log.imu.front().time, images.front()) + offset;
  const double end = seconds_between(log.imu.front().time, images.back()) + offset;
  const double whole = seconds_between(log.imu.front().time, log.imu.back().time);
  if (end >= 0 && begin <= whole) return {};
  return Error{
      fmt::format("{}: the images are of {:.3f} to {:.3f} s after the first sample of the IMU (time offset "
                  "{:.6f} s), expected "
                  "some of the {:.3f} s that it lasts; pade calibrate time finds the offset",
                  name, begin, end, offset, whole)};
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
  return camera_trajectory_of(*checked, folder.string(), frames, mounting, options, images);
}

Result<CameraTrajectory> camera_trajectory_of(const CheckedLog& checked, const std::string& name,
                                              const std::vector<Time>& frames, const CameraMounting& mounting,
                                              const navigation::NavigatorOptions& options,
                                              const FedImages* images) {
  const NavigationLog* const log = &checked.log;
  if (log->gnss.velocities.empty() || log->gnss.fixes.empty()) {
    return Error{fmt::format(
        "{}: no GNSS positions and velocities found, expected them in gnss.csv or the recording", name)};
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
  trajectory.hints = all_hints(checked, run);
  if (feedback) trajectory.notes = notes_on(*feedback, run);
  if (trajectory.times.empty()) return never_aligned(name, checked, run);
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

Status check_mounting(const std::filesystem::path& folder, const io::Calibration& calibration) {
  if (calibration.T_body_camera) return {};
  return Error{
      fmt::format("{}: field T_body_camera is missing in the calibration, expected it because the poses "
                  "come from the "
                  "body's sensors (pade calibrate mounting finds its rotation)",
                  folder.string())};
}

io::PoseSource poses_from_imu_gnss(const navigation::NavigatorOptions& options, const SensorSource& source,
                                   const FedImages* images) {
  return [options, source, images](const std::filesystem::path& folder, const std::vector<Time>& times,
                                   const io::Calibration& calibration) -> Result<io::ComputedPoses> {
    if (const Status mounted = check_mounting(folder, calibration); !mounted) return mounted.error();
    const bool apart = !source.log.empty();
    if (apart && !source.time_offset && !calibration.time_offset_s) {
      return Error{
          fmt::format("{}: how its clock relates to that of the images is not said, expected --time-offset "
                      "with seconds or auto, "
                      "or time_offset_s in the calibration (0 if the clock is one)",
                      source.log.string())};
    }
    CameraMounting mounting{*calibration.T_body_camera, calibration.time_offset_s,
                            calibration.gnss_lever_arm};
    if (source.time_offset) mounting.time_offset = source.time_offset;
    const std::filesystem::path& place = apart ? source.log : folder;
    const auto read = [&] {
      if (source.read) return source.read(place, source.topics);
      io::NavigationLogOptions log_options;
      log_options.topics = source.topics;
      return read_checked_log(place, log_options);
    };
    auto checked = read();
    if (!checked) return checked.error();
    if (apart || source.time_offset) {
      const double offset = mounting.time_offset.value_or(options.camera_time_offset);
      if (const Status status = check_overlap(place.string(), checked->log, times, offset); !status)
        return status.error();
      put_on_image_clock(checked->log, offset);
      mounting.time_offset = 0;
    }
    const auto trajectory = camera_trajectory_of(*checked, place.string(), times, mounting, options, images);
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
    if (std::string note = note_on_clocks(source, calibration.time_offset_s); !note.empty())
      result.notes.push_back(std::move(note));
    if (apart) {
      std::string note = fmt::format("the sensors are those of {}", place.string());
      if (const auto& origin = trajectory->origin)
        note += fmt::format(", 0 0 0 is latitude {:.7f}, longitude {:.7f}, height {:.2f} m", origin->latitude,
                            origin->longitude, origin->height);
      result.notes.push_back(std::move(note));
      result.notes.insert(result.notes.end(), checked->log.remarks.begin(), checked->log.remarks.end());
    }
    return result;
  };
}

}  // namespace pade
