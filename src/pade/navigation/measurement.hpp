// A measurement of any sensor but the IMU, and what the filter made of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>

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

/// Sensors, in the order of Measurement::value; also the order in which measurements of one stamp are used.
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

/// A measurement of any sensor.
struct Measurement {
  /// As the sensor delivered it, with its own stamp. An epoch of raw GNSS is never null; a motion is null for
  /// an image from which one may be measured.
  using Value = std::variant<GnssVelocity, GnssFix, BarometricHeight, Heading, MagneticField, ZeroVelocity,
                             RangeToGround, RoadMotion, std::shared_ptr<const RawEpoch>,
                             std::shared_ptr<const CameraMotion>>;

  Time time;              ///< on the filter's time scale: the sensor's stamp less its latency
  Value value;            ///< what was measured
  Innovation innovation;  ///< of its last use by the live filter

  Measurement() = default;
  /// Of what a sensor has delivered, at a time of the filter's scale.
  Measurement(Time at, Value of) : time(at), value(std::move(of)) {}

  /// Which sensor it is of.
  [[nodiscard]] SensorKind kind() const { return static_cast<SensorKind>(value.index()); }
  /// Null if it is of another sensor, or of an image without a motion.
  template <class Sensor>
  [[nodiscard]] const Sensor* get_if() const {
    return std::get_if<Sensor>(&value);
  }
};
inline constexpr std::size_t sensor_kinds = std::variant_size_v<Measurement::Value>;  ///< how many there are

}  // namespace pade::navigation
