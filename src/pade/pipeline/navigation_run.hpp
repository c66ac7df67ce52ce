// A log played through the navigation filter: the trajectory, the motion between frames, innovations and
// health. Also the way from a sequence's imu.csv and gnss.csv to camera poses.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/evaluation/navigation_score.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/plausibility.hpp"

namespace pade {

struct NavigationRunOptions {
  navigation::NavigatorOptions navigator;
  std::vector<Time> frames;        ///< image times; empty: every `1 / rate` seconds of the IMU log
  double rate = 10;                ///< Hz
  Pose T_body_camera;              ///< of the motions; the trajectory is the body's
  std::optional<Heading> heading;  ///< a yaw known at the start
  bool on_road = false;            ///< a vehicle on wheels, which moves along its x axis only
};

/// The state at one frame.
struct NavigationFrame {
  Time time;
  navigation::AbsolutePose pose;
  navigation::NavigationStatus status = navigation::NavigationStatus::uninitialised;
};

/// The motion of the camera from one frame to the next.
struct FrameMotion {
  Time t1;
  Time t2;
  navigation::RelativePose pose;
};

struct NavigationRun {
  std::vector<NavigationFrame> frames;                ///< only those with an answer
  std::vector<FrameMotion> motions;                   ///< of neighbouring frames with an answer
  std::vector<navigation::Measurement> measurements;  ///< each with its last innovation
  navigation::Health health;
  std::vector<navigation::SensorSummary> sensors;
  std::size_t frames_without_answer = 0;
  std::optional<evaluation::MotionSummary> score;  ///< body motion against log.truth, where there is truth
};

/// A log, and what should be known of it before its results are relied on.
struct CheckedLog {
  NavigationLog log;
  std::vector<Hint> hints;  ///< worst first
};
/// Reads a log folder, puts jittering IMU stamps on a line (navigation::regularise_stamps) and checks the log
/// (navigation::check_log). Errors: io::read_navigation_log.
Result<CheckedLog> read_checked_log(const std::filesystem::path& folder,
                                    const io::NavigationLogOptions& options = {});

/// The hints of a log and those of its run, worst first.
std::vector<Hint> all_hints(const CheckedLog& checked, const NavigationRun& run);

/// Why a run has no frame: its status, and the hints of the log.
Error never_aligned(const std::string& folder, const CheckedLog& checked, const NavigationRun& run);

/// Plays the whole log in the order of its stamps. Every frame is answered causally, as in flight.
NavigationRun run_navigation(const NavigationLog& log, const NavigationRunOptions& options);

/// The files of a run: "trajectory.txt" (TUM, T_world_body), "relative_motion.csv" (t1, t2, translation and
/// quaternion x y z w of frame 2 in frame 1, upper triangle of the 6x6 covariance of translation and rotation
/// vector, flags).
std::string format_trajectory(const NavigationRun& run);
std::string format_relative_motion(const NavigationRun& run);

/// Camera poses from inertial and GNSS data for a pipeline that takes poses.
struct CameraTrajectory {
  std::vector<Time> times;  ///< of the frames with a pose, rising
  std::vector<Pose> poses;  ///< T_world_camera; the motion between neighbours is `motions`, exactly
  std::vector<RelativeMotion> motions;   ///< from frame i (reference) to frame i + 1, with covariance
  std::vector<bool> scale_valid;         ///< of each motion
  std::vector<bool> direction_valid;     ///< of each motion
  std::size_t frames_left = 0;           ///< with an answer, but not in the longest unbroken chain
  std::optional<GeodeticOrigin> origin;  ///< of the world, where the GNSS log has one
  navigation::Health health;
  std::vector<Hint> hints;  ///< of log and run, worst first
};

/// What of a camera's calibration matters here.
struct CameraMounting {
  Pose T_body_camera;
  double time_offset = 0;                         ///< t_imu = t_image + offset, s
  std::optional<Eigen::Vector3d> gnss_lever_arm;  ///< body, m; else what the GNSS log says
};

/// Runs the filter on imu.csv and gnss.csv (and baro.csv, mag.csv) of a sequence folder. The first pose is
/// the filter's own; each further one adds the relative motion read from clones, so that corrections of the
/// absolute position never appear as motion (the price: the chain drifts from the GNSS by the integral of the
/// velocity's error). Frames before the filter knows its yaw have no pose. A filter that has to start anew
/// breaks the chain: the longest is kept and `frames_left` counts the others. Errors: a log that cannot be
/// read; no frame with a pose.
Result<CameraTrajectory> camera_trajectory_from_imu_gnss(const std::filesystem::path& folder,
                                                         const std::vector<Time>& frames,
                                                         const CameraMounting& mounting,
                                                         const navigation::NavigatorOptions& options = {});

/// What a person should know of the trajectory: motions of doubtful length and direction, and frames left
/// out.
std::vector<std::string> notes_on(const CameraTrajectory& trajectory);

/// What `--poses from-imu-gnss` is called in options and runs.
inline constexpr const char* poses_from_sensors = "from-imu-gnss";

/// The same as a source of poses for io::Sequence. Errors: those of the function above; no GNSS data; a
/// calibration without T_body_camera.
io::PoseSource poses_from_imu_gnss(const navigation::NavigatorOptions& options);

}  // namespace pade
