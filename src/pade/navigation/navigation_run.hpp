// A log played through the navigation filter: the trajectory, the motion between frames, innovations and
// health; and the poses of a camera that follow from it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/hint.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/plausibility/plausibility.hpp"

namespace pade {

struct NavigationRunOptions {
  navigation::NavigatorOptions navigator;
  std::vector<Time> frames;        ///< image times; empty: every `1 / rate` seconds of the IMU log
  double rate = 10;                ///< Hz
  Pose T_body_camera;              ///< of the motions; the trajectory is the body's
  std::optional<Heading> heading;  ///< a yaw known at the start
  std::vector<std::shared_ptr<const navigation::RawEpoch>>
      raw;               ///< raw GNSS beside the log's own; none is null
  bool on_road = false;  ///< a vehicle on wheels, which moves along its x axis only
  /// Looks at the images of two neighbouring frames, when the later one has come, and says what they show of
  /// the motion, if anything: it goes into the filter (FilterOptions::camera). It is told the motion that the
  /// filter then knows, which has no answer before the filter has started. Empty: no camera.
  std::function<std::optional<navigation::CameraMotion>(Time t1, Time t2,
                                                        const navigation::RelativePose& known)>
      camera;
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
  NavigationHealth health;
  navigation::RawTally raw;        ///< of raw GNSS
  navigation::CameraTally camera;  ///< of the camera's motions
  Eigen::Quaterniond camera_mounting =
      Eigen::Quaterniond::Identity();  ///< Navigator::camera_mounting() at the end
};

/// Plays the whole log in the order of its stamps. Every frame is answered causally, as in flight.
NavigationRun run_navigation(const NavigationLog& log, const NavigationRunOptions& options);

/// Camera poses for a pipeline that takes poses.
struct CameraTrajectory {
  std::vector<Time> times;  ///< of the frames with a pose, rising
  std::vector<Pose> poses;  ///< T_world_camera; the motion between neighbours is `motions`, exactly
  std::vector<RelativeMotion> motions;   ///< from frame i (reference) to frame i + 1, with covariance
  std::vector<bool> scale_valid;         ///< of each motion
  std::vector<bool> direction_valid;     ///< of each motion
  std::size_t frames_left = 0;           ///< with an answer, but not in the longest unbroken chain
  std::optional<GeodeticOrigin> origin;  ///< of the world, where the GNSS log has one
  NavigationHealth health;               ///< of the run
  std::vector<Hint> hints;               ///< of log and run, worst first; filled by who knows the log
  std::vector<std::string> notes;        ///< what became of the camera, if it was fed back; likewise
};

/// The longest unbroken chain of a run's motions as poses of the camera. The first pose is the filter's own;
/// each further one adds the relative motion read from clones, so that corrections of the absolute position
/// never appear as motion (the price: the chain drifts from the GNSS by the integral of the velocity's
/// error). A filter that has to start anew breaks the chain: `frames_left` counts what lies outside the
/// longest. Without poses if no two neighbouring frames have an answer.
/// @param T_body_camera  that of the run's options
CameraTrajectory camera_trajectory(const NavigationRun& run, const Pose& T_body_camera);

}  // namespace pade
