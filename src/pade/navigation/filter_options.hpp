// The constants of the filter and of its start: one set per class of sensor, never per recording.
#pragma once

#include <array>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::navigation {

/// Which constants suit an IMU.
enum class ImuClass {
  industrial,  ///< tactical or industrial grade: the defaults
  consumer,    ///< of a phone or a small autopilot
};

/// Noise, gates and floors of the filter (docs/navigation.md says where each number comes from).
struct FilterOptions {
  double gravity = 9.80665;  ///< m/s², along world -z; the Earth's rate is below the noise of these sensors

  // White noise: a part that is always there (gyroscopes: measured at rest; accelerometers: what scale and
  // alignment errors do in manoeuvres, far above the sheet), and what rotors and engines add. That is
  // measured: white samples of spread s and interval dt have the density s sqrt(dt); vibration has this share
  // of it.
  double gyroscope_noise = 1.3e-4;        ///< rad/s/sqrt(Hz)
  double accelerometer_noise = 2e-2;      ///< m/s²/sqrt(Hz)
  double gyroscope_vibration = 0.02;      ///< share
  double accelerometer_vibration = 0.45;  ///< share
  double gyroscope_bias_walk = 4e-5;      ///< rad/s/sqrt(s)
  double accelerometer_bias_walk = 2e-3;  ///< m/s²/sqrt(s)
  double gyroscope_bias_sigma = 0.05;     ///< before the first levelling, rad/s
  double accelerometer_bias_sigma = 0.1;  ///< m/s²
  double gyroscope_range = 17;            ///< a sample beyond it is saturated, rad/s
  double accelerometer_range = 155;       ///< m/s²

  // What may happen between two samples farther apart than `gap`.
  double gap = 0.06;            ///< s
  double gap_rate = 0.5;        ///< rms of the unseen angular rate, rad/s
  double gap_acceleration = 2;  ///< rms of the unseen acceleration, m/s²

  // GNSS positions: the reported variance is split into white noise and a Gauss-Markov bias.
  double single_point_white_share = 0.0588;    ///< of the variance (0.25 m of 1.03 m)
  double single_point_correlation_time = 120;  ///< s
  double carrier_phase_white_share = 0.8;      ///< (1 cm of 1.12 cm)
  double carrier_phase_correlation_time = 60;  ///< s
  double carrier_phase_limit = 0.1;            ///< reported horizontal sigma that divides the two, m
  double position_sigma_floor = 0.005;         ///< of a fix that claims less (or zero), m
  double velocity_sigma_floor = 0.01;          ///< m/s

  double barometer_bias_sigma = 20;          ///< of its unknown zero, m
  double barometer_correlation_time = 3000;  ///< s

  double iron_sigma = 0.03;  ///< field of the vehicle's iron per body axis, share of the Earth's field
  double iron_correlation_time = 600;  ///< s

  // Raw GNSS (docs/navigation.md, section 7). A clock of temperature-compensated quartz.
  bool raw_gnss = false;          ///< raw epochs are expected, in place of positions and velocities
  double clock_noise = 0.1;       ///< of the clock, m/sqrt(s)
  double clock_drift_walk = 0.2;  ///< of its drift, m/s/sqrt(s)
  double raw_bias_sigma = 1;      ///< what all ranges together are wrong by for minutes, per axis, m
  double raw_gate = 4;            ///< sigmas beyond which a measurement of a satellite is not used
  double phase_anchor_time = 1;   ///< phases are counted from one epoch for so long, s

  // Motions between images (docs/navigation.md, section 9).
  bool camera = false;  ///< they are expected
  double camera_mounting_sigma =
      0.005;                    ///< of the calibrated rotation of the camera on the body, per axis, rad
  double camera_inflation = 1;  ///< of the variance that a motion between images claims
  double camera_gyroscope_noise = 2.4e-4;  ///< the gyroscopes' white noise is at least this, as images make
                                           ///< the bias known that else covers it, rad/s/sqrt(Hz)

  // Robustness.
  double gate_probability_3 = 16.27;  ///< chi-square bound of 3 degrees of freedom (99.9 %)
  double gate_probability_2 = 13.82;  ///< of 2 degrees of freedom
  double gate_probability_1 = 10.83;  ///< of 1 degree of freedom
  double soft_gate = 3;  ///< up to this multiple of the bound a measurement is kept with inflated noise
  double reacquire_after = 1.0;  ///< seconds of nothing but rejections after which the sensor is believed
  double drift_bound = 42;       ///< of the drift of innovations, beyond which the covariance is refuted

  /// The set of a class of IMU.
  static FilterOptions of(ImuClass imu);

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("gravity", self.gravity, "m/s², downwards");
    field("gyroscope_noise", self.gyroscope_noise, "white noise without vibration, rad/s/sqrt(Hz)");
    field("accelerometer_noise", self.accelerometer_noise, "white noise without vibration, m/s²/sqrt(Hz)");
    field("gyroscope_vibration", self.gyroscope_vibration, "share of the vibration that acts as noise");
    field("accelerometer_vibration", self.accelerometer_vibration,
          "share of the vibration that acts as noise");
    field("gyroscope_bias_walk", self.gyroscope_bias_walk, "rad/s/sqrt(s)");
    field("accelerometer_bias_walk", self.accelerometer_bias_walk, "m/s²/sqrt(s)");
    field("gyroscope_bias_sigma", self.gyroscope_bias_sigma, "before levelling, rad/s");
    field("accelerometer_bias_sigma", self.accelerometer_bias_sigma, "before levelling, m/s²");
    field("gyroscope_range", self.gyroscope_range, "saturation, rad/s");
    field("accelerometer_range", self.accelerometer_range, "saturation, m/s²");
    field("gap", self.gap, "samples farther apart than this leave a gap, s");
    field("gap_rate", self.gap_rate, "rms angular rate assumed in a gap, rad/s");
    field("gap_acceleration", self.gap_acceleration, "rms acceleration assumed in a gap, m/s²");
    field("single_point_white_share", self.single_point_white_share, "white share of the reported variance");
    field("single_point_correlation_time", self.single_point_correlation_time, "of the Gauss-Markov bias, s");
    field("carrier_phase_white_share", self.carrier_phase_white_share,
          "white share of the reported variance");
    field("carrier_phase_correlation_time", self.carrier_phase_correlation_time,
          "of the Gauss-Markov bias, s");
    field("carrier_phase_limit", self.carrier_phase_limit, "reported sigma that divides the two classes, m");
    field("position_sigma_floor", self.position_sigma_floor, "least sigma of a fix, m");
    field("velocity_sigma_floor", self.velocity_sigma_floor, "least sigma of a velocity, m/s");
    field("barometer_bias_sigma", self.barometer_bias_sigma, "of the barometer's zero, m");
    field("barometer_correlation_time", self.barometer_correlation_time, "of the barometer's zero, s");
    field("iron_sigma", self.iron_sigma, "field of the vehicle's iron, share of the Earth's field");
    field("iron_correlation_time", self.iron_correlation_time, "s");
    field("raw_gnss", self.raw_gnss, "raw epochs are expected, in place of positions and velocities");
    field("clock_noise", self.clock_noise, "of the receiver's clock, m/sqrt(s)");
    field("clock_drift_walk", self.clock_drift_walk, "of its drift, m/s/sqrt(s)");
    field("raw_bias_sigma", self.raw_bias_sigma,
          "what all pseudoranges together are wrong by for minutes, per axis, m");
    field("raw_gate", self.raw_gate, "sigmas beyond which a measurement of a satellite is not used");
    field("phase_anchor_time", self.phase_anchor_time, "phases are counted from one epoch for so long, s");
    field("camera", self.camera, "motions between images are expected");
    field("camera_mounting_sigma", self.camera_mounting_sigma,
          "of the calibrated rotation of the camera on the body, per axis, rad");
    field("camera_inflation", self.camera_inflation, "of the variance that a motion between images claims");
    field("camera_gyroscope_noise", self.camera_gyroscope_noise,
          "least white noise of the gyroscopes where motions between images are expected, rad/s/sqrt(Hz)");
    field("gate_probability_3", self.gate_probability_3, "chi-square gate, 3 degrees of freedom");
    field("gate_probability_2", self.gate_probability_2, "chi-square gate, 2 degrees of freedom");
    field("gate_probability_1", self.gate_probability_1, "chi-square gate, 1 degree of freedom");
    field("soft_gate", self.soft_gate, "multiple of the gate up to which noise is inflated instead");
    field("reacquire_after", self.reacquire_after, "seconds of rejections before a sensor is believed again");
    field("drift_bound", self.drift_bound,
          "chi-square of the drift of innovations that refutes the covariance");
  }
};

/// Of the start (alignment.hpp).
struct AlignmentOptions {
  double level_time = 2.0;              ///< seconds of rest for levelling
  double rest_rate_sigma = 0.02;        ///< spread of the angular rate that counts as rest, rad/s
  double rest_force_sigma = 0.7;        ///< spread of the specific force that counts as rest, m/s²
  double rest_speed = 0.3;              ///< GNSS speed that does not contradict rest, m/s
  double motion_window = 1.0;           ///< baseline of the first GNSS velocities of a start in motion, s
  double heading_sigma_magnetic = 0.3;  ///< of a start at a magnetometer's yaw, which updates narrow, rad
  int hypotheses = 12;                  ///< yaws of the bank
  double yaw_known = 0.15;              ///< spread of the bank's yaw at which the best filter is taken, rad
  double lag = 0.4;                     ///< the bank waits this long for late data, s

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("level_time", self.level_time, "seconds of rest for levelling");
    field("rest_rate_sigma", self.rest_rate_sigma, "spread of the angular rate that counts as rest, rad/s");
    field("rest_force_sigma", self.rest_force_sigma,
          "spread of the specific force that counts as rest, m/s²");
    field("rest_speed", self.rest_speed, "GNSS speed that does not contradict rest, m/s");
    field("motion_window", self.motion_window,
          "baseline of the first GNSS velocities of a start in motion, s");
    field("heading_sigma_magnetic", self.heading_sigma_magnetic, "of a magnetometer's first yaw, rad");
    field("hypotheses", self.hypotheses, "yaws of the bank");
    field("yaw_known", self.yaw_known, "spread of the bank's yaw at which the best filter is taken, rad");
    field("lag", self.lag, "the start waits this long for late data, s");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const FilterOptions& options);
Status check(const AlignmentOptions& options);  ///< the same for those of the start

}  // namespace pade::navigation

template <>
struct pade::EnumNames<pade::navigation::ImuClass> {
  static constexpr std::array names = {
      std::pair{pade::navigation::ImuClass::industrial, std::string_view("industrial")},
      std::pair{pade::navigation::ImuClass::consumer, std::string_view("consumer")},
  };
};
