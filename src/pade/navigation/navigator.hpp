// GPS/INS navigation for depth estimation: sensor data in (in any order, late, with gaps), relative pose of
// the camera between any two times of the recent past out, with covariance and health. Section 4.1 of the
// paper.
//
// One thread; no allocation after construction.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

#include "pade/core/health.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/navigation/filter_options.hpp"
#include "pade/navigation/measurement.hpp"

namespace pade::navigation {

/// Options of Navigator: the vehicle's mounting and latencies, and what counts as good enough.
struct NavigatorOptions {
  FilterOptions filter;                        ///< noise and gates
  AlignmentOptions alignment;                  ///< the start
  Vector3d gnss_lever_arm = Vector3d::Zero();  ///< antenna in the body frame, m
  double gnss_position_latency = 0;            ///< subtracted from the stamps of sensors that stamp late, s
  double gnss_velocity_latency = 0;            ///< s
  double barometer_latency = 0;                ///< s
  double magnetometer_latency = 0;             ///< s
  double camera_time_offset = 0;               ///< t_imu = t_image + offset, s
  double declination = 0;                      ///< of magnetic north, towards east, rad
  double history = 2;                          ///< seconds that late data and questions may reach back
  double imu_rate = 500;                       ///< highest expected, Hz; sizes the buffers
  double dead_reckoning_after = 1;             ///< seconds without GNSS velocity
  double longest_gap = 3;                      ///< without IMU data; beyond it the filter starts anew, s
  double scale_error_limit = 0.2;              ///< of the baseline's length: the noise bound of the paper
  double scale_error_sigmas = 2.0;      ///< `scale_valid` asks for limit * baseline > this * sigma along it
  double direction_error_limit = 0.35;  ///< of the baseline's direction: what images can still mend, rad
  double direction_error_sigmas = 2.7;  ///< `direction_valid` asks for limit * baseline > this * sigma across

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("filter", self.filter, "noise and gates");
    field("alignment", self.alignment, "the start");
    field("gnss_lever_arm_x", self.gnss_lever_arm[0], "antenna in the body frame, forward, m");
    field("gnss_lever_arm_y", self.gnss_lever_arm[1], "antenna in the body frame, left, m");
    field("gnss_lever_arm_z", self.gnss_lever_arm[2], "antenna in the body frame, up, m");
    field("gnss_position_latency", self.gnss_position_latency, "s");
    field("gnss_velocity_latency", self.gnss_velocity_latency, "s");
    field("barometer_latency", self.barometer_latency, "s");
    field("magnetometer_latency", self.magnetometer_latency, "s");
    field("camera_time_offset", self.camera_time_offset, "t_imu = t_image + offset, s");
    field("declination", self.declination, "of magnetic north, towards east, rad");
    field("history", self.history, "seconds that late data and questions may reach back");
    field("imu_rate", self.imu_rate, "highest expected, Hz");
    field("dead_reckoning_after", self.dead_reckoning_after, "seconds without GNSS velocity");
    field("longest_gap", self.longest_gap, "without IMU data; beyond it the filter starts anew, s");
    field("scale_error_limit", self.scale_error_limit,
          "error of the baseline's length that spoils depth, relative");
    field("scale_error_sigmas", self.scale_error_sigmas, "sigmas that must fit into it");
    field("direction_error_limit", self.direction_error_limit,
          "error of the baseline's direction that images can still mend, rad");
    field("direction_error_sigmas", self.direction_error_sigmas, "sigmas that must fit into it");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const NavigatorOptions& options);

/// The answer to a question that cannot always be answered.
enum class Answer : std::uint8_t {
  valid,            ///< there is an answer
  not_initialised,  ///< the filter has not started yet
  too_old,          ///< before the history
  too_new,          ///< after the newest IMU sample
};

/// Motion of the camera between two times. Everything but `answer` and `status` has a meaning only if
/// `answer` is valid.
struct RelativePose {
  Answer answer = Answer::not_initialised;  ///< whether the question could be answered
  /// Reference: the camera at t1, other: at t2. Covariance as RelativeMotion has it.
  RelativeMotion motion;
  bool scale_valid = false;      ///< the baseline is long enough, given its uncertainty, to fix the scale
  bool direction_valid = false;  ///< so is that of its direction; says nothing about the length
  NavigationStatus status = NavigationStatus::uninitialised;  ///< of the filter at t2
};

/// The state of the body at one time. Everything but `answer` has a meaning only if that is valid.
struct AbsolutePose {
  Answer answer = Answer::not_initialised;  ///< whether the question could be answered
  Pose T_world_body;                        ///< global: jumps with corrections
  Pose T_smooth_body;                       ///< without jumps; drifts towards the global one within seconds
  Vector3d velocity = Vector3d::Zero();     ///< ENU, m/s
  Matrix9d covariance = Matrix9d::Zero();   ///< of (φ, ν, ρ), body axes (filter_state.hpp)
  Vector3d gyroscope_bias = Vector3d::Zero();      ///< rad/s
  Vector3d accelerometer_bias = Vector3d::Zero();  ///< m/s²
};

/// The GPS/INS filter: an invariant extended Kalman filter over a short history, so that late data and
/// questions about the past are answered as if nothing had been late (docs/navigation.md).
class Navigator {
 public:
  /// Refuses options that make no sense; the message names the option.
  static Result<Navigator> create(const NavigatorOptions& options);
  explicit Navigator(const NavigatorOptions& options);  ///< of options that check() accepts
  /// @{
  /// What was moved from can only be assigned to or destroyed.
  Navigator(Navigator&&) noexcept;
  Navigator& operator=(Navigator&&) noexcept;
  /// @}
  ~Navigator();

  /// @{
  /// A sample or a measurement, stamped at the moment of measurement, in any order. Data that cannot be used
  /// is counted in health().
  void add(const ImuSample& sample);
  void add(const GnssFix& measurement);
  void add(const GnssVelocity& measurement);
  void add(const BarometricHeight& measurement);
  void add(const Heading& measurement);
  void add(const MagneticField& measurement);
  void add(const ZeroVelocity& measurement);
  void add(const RangeToGround& measurement);
  void add(const RoadMotion& measurement);
  /// Raw GNSS, of which the options say that it is expected (FilterOptions::raw_gnss); else its position and
  /// velocity are used. Null is passed over.
  void add(std::shared_ptr<const RawEpoch> measurement);
  /// The motion between two images, when these have been looked at: after t2, within the history. The options
  /// say that it is expected (FilterOptions::camera); else, or if it makes no sense, it counts as unusable.
  /// It takes effect at t2. Each call allocates a little.
  void add(const CameraMotion& measurement);
  /// @}

  /// Motion of the camera from image time t1 to image time t2 (t2 >= t1), from a clone at t1 within a replay
  /// that ends at t2: nothing stamped after t2 is used, however late the question comes.
  RelativePose relative_pose(Time t1, Time t2, const Pose& T_body_camera);
  /// The state at image time t, with what was measured until then.
  AbsolutePose absolute_pose(Time t);

  /// As of the newest data.
  [[nodiscard]] Health health();
  /// As they were given.
  [[nodiscard]] const NavigatorOptions& options() const;
  /// What became of raw GNSS, satellite by satellite, since the last start of the filter.
  [[nodiscard]] RawTally raw_tally() const;
  /// What became of the camera's motions, since the last start of the filter.
  [[nodiscard]] CameraTally camera_tally() const;
  /// R_calibrated_camera: how the camera's mounting differs from its calibration, as far as is known.
  [[nodiscard]] Quaterniond camera_mounting() const;
  [[nodiscard]] Time newest() const;  ///< of the IMU samples
  /// Called with each measurement when it leaves the history, with the innovation of its last use.
  void on_retired(std::function<void(const Measurement&)> sink);
  /// Retires everything: at the end of a log.
  void finish();

 private:
  class Core;
  std::unique_ptr<Core> core_;
};

}  // namespace pade::navigation
