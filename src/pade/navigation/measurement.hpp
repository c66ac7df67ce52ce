// A measurement of any sensor but the IMU, and what the filter made of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "pade/core/lie.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/core/time.hpp"
#include "pade/navigation/camera/camera_motion.hpp"

namespace pade::navigation {

/// An epoch of raw GNSS, prepared for the filter: tight/raw_epoch.hpp, which is not installed yet.
struct RawEpoch;

/// How many measurements of single satellites were used and refused.
struct RawCounts {
  std::uint64_t used = 0;     ///< by the filter
  std::uint64_t refused = 0;  ///< that do not fit
};

/// What became of raw GNSS.
struct RawTally {
  RawCounts ranges;               ///< pseudoranges
  RawCounts rates;                ///< from Doppler
  RawCounts phases;               ///< changes of the carriers' phases
  std::uint64_t clock_jumps = 0;  ///< of the receiver's clock, by whole milliseconds
};

/// What became of a measurement.
enum class Verdict : std::uint8_t {
  accepted,    ///< used as it is
  inflated,    ///< outside the gate, used with its noise enlarged so that it lies on the gate
  rejected,    ///< far outside
  reacquired,  ///< after a time of nothing but rejections: the state was opened for it and moved
  unusable,    ///< not finite, or without meaning in this state
};

/// Innovation of one measurement; unused components are zero.
struct Innovation {
  Verdict verdict = Verdict::unusable;  ///< what became of it
  int size = 0;  ///< components that are used, 0 to 3; of a camera 0 to 5, the rotation is kept below
  Vector3d residual = Vector3d::Zero();  ///< measured less predicted, in the unit of the measurement
  Vector3d sigma = Vector3d::Zero();     ///< predicted, before any inflation
  Vector3d white = Vector3d::Zero();     ///< the residual in units of its predicted covariance, S^(-1/2) r
  double chi_square = 0;      ///< squared Mahalanobis length of the residual: the gate is a bound on it
  double log_likelihood = 0;  ///< of the residual under its predicted covariance, without the constant
  std::uint64_t refused_ranges = 0;  ///< of raw GNSS: bit i is satellite i of the epoch
  std::uint64_t refused_phases = 0;  ///< likewise, where the phase went on since the anchor but did not fit
  double jump = 0;  ///< distance the position (or speed the velocity) moved in a re-acquisition, m or m/s
};

/// Sensors; also the order in which measurements of one stamp are used.
enum class SensorKind : std::uint8_t {
  gnss_velocity,
  gnss_position,
  barometer,
  heading,
  magnetometer,
  zero_velocity,
  range,
  road,
  raw_gnss,
  camera
};
inline constexpr std::size_t sensor_kinds =
    static_cast<std::size_t>(SensorKind::camera) + 1;  ///< camera is the last

/// A measurement of any kind.
struct Measurement {
  Time time;                                    ///< of the measurement, less the sensor's latency
  SensorKind kind = SensorKind::gnss_position;  ///< says what `value` is
  Vector3d value = Vector3d::Zero();            ///< scalar sensors use the first component
  Matrix3d covariance = Matrix3d::Identity();   ///< GNSS only
  double sigma = 0;                             ///< the others
  double extra = 0;                             ///< ground height of a range
  std::shared_ptr<const RawEpoch> raw;          ///< raw GNSS only, and then not null
  std::shared_ptr<const CameraMotion> camera;  ///< camera only; null: an image from which one may be measured
  Innovation innovation;                       ///< of its last use by the live filter

  Measurement() = default;
  /// @{
  /// From what the sensors deliver (core/sensors/measurements.hpp).
  explicit Measurement(const GnssFix& m) : time(m.time), value(m.position), covariance(m.covariance) {}
  explicit Measurement(const GnssVelocity& m)
      : time(m.time), kind(SensorKind::gnss_velocity), value(m.velocity), covariance(m.covariance) {}
  explicit Measurement(const BarometricHeight& m)
      : time(m.time), kind(SensorKind::barometer), value(m.height, 0, 0), sigma(m.sigma) {}
  explicit Measurement(const Heading& m)
      : time(m.time), kind(SensorKind::heading), value(m.yaw, 0, 0), sigma(m.sigma) {}
  explicit Measurement(const MagneticField& m)
      : time(m.time), kind(SensorKind::magnetometer), value(m.field), sigma(m.sigma) {}
  explicit Measurement(const ZeroVelocity& m)
      : time(m.time), kind(SensorKind::zero_velocity), sigma(m.sigma) {}
  explicit Measurement(const RangeToGround& m)
      : time(m.time), kind(SensorKind::range), value(m.range, 0, 0), sigma(m.sigma), extra(m.ground_height) {}
  explicit Measurement(const RoadMotion& m) : time(m.time), kind(SensorKind::road), sigma(m.sigma) {}
  Measurement(std::shared_ptr<const RawEpoch> epoch, Time stamp)
      : time(stamp), kind(SensorKind::raw_gnss), raw(std::move(epoch)) {}
  Measurement(std::shared_ptr<const CameraMotion> motion, Time stamp)
      : time(stamp), kind(SensorKind::camera), camera(std::move(motion)) {}
  /// @}
};

}  // namespace pade::navigation
