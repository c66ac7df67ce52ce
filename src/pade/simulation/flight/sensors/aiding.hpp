// The sensors that aid an inertial system: GNSS position and velocity, barometer, magnetometer.
#pragma once

#include <cstdint>
#include <vector>

#include "pade/core/random.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/simulation/flight/sensors/kinematics.hpp"
#include "pade/simulation/flight/sensors/noise.hpp"

namespace pade::simulation {

/// Errors of a GNSS receiver; horizontal and vertical standard deviations per axis.
struct GnssModel {
  double white_horizontal = 0.25;      ///< m
  double white_vertical = 0.4;         ///< m
  double bias_horizontal = 1.0;        ///< Gauss-Markov part (multipath, atmosphere, orbits), m
  double bias_vertical = 1.6;          ///< m
  double bias_correlation_time = 120;  ///< s
  double velocity_horizontal = 0.05;   ///< m/s
  double velocity_vertical = 0.08;     ///< m/s
  double outlier_fraction = 0;         ///< of the epochs; position and velocity are hit together
  double outlier_position = 20;        ///< standard deviation of an outlier per axis, m
  double outlier_velocity = 2;         ///< m/s
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();  ///< antenna in the body frame, m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("white_horizontal", self.white_horizontal, "white position error per horizontal axis, m");
    field("white_vertical", self.white_vertical, "white position error, vertical, m");
    field("bias_horizontal", self.bias_horizontal, "Gauss-Markov position error per horizontal axis, m");
    field("bias_vertical", self.bias_vertical, "Gauss-Markov position error, vertical, m");
    field("bias_correlation_time", self.bias_correlation_time, "of the Gauss-Markov part, s");
    field("velocity_horizontal", self.velocity_horizontal, "velocity error per horizontal axis, m/s");
    field("velocity_vertical", self.velocity_vertical, "velocity error, vertical, m/s");
    field("outlier_fraction", self.outlier_fraction, "fraction of the epochs that are wrong");
    field("outlier_position", self.outlier_position, "standard deviation of a wrong position per axis, m");
    field("outlier_velocity", self.outlier_velocity, "standard deviation of a wrong velocity per axis, m/s");
    field("lever_arm_x", self.lever_arm[0], "antenna in the body frame, forward, m");
    field("lever_arm_y", self.lever_arm[1], "antenna in the body frame, left, m");
    field("lever_arm_z", self.lever_arm[2], "antenna in the body frame, up, m");
  }

  /// Single-point positioning with Doppler velocity: the defaults.
  static GnssModel single_point() { return {}; }
  /// Carrier phase with fixed ambiguities.
  static GnssModel carrier_phase();
};

/// One epoch: position and velocity at the same stamp. The reported covariance is the total (white plus
/// Gauss-Markov), as receivers report it; outliers are not announced.
struct GnssEpoch {
  GnssFix fix;
  GnssVelocity velocity;
};

class Gnss {
 public:
  Gnss(const GnssModel& model, std::uint64_t seed);
  GnssEpoch sample(const KinematicState& truth);
  [[nodiscard]] const Eigen::Vector3d& bias() const { return bias_.value(); }

 private:
  GnssModel model_;
  Random random_;
  GaussMarkov3 bias_;
  bool started_ = false;
  Time last_;
};

struct BarometerModel {
  double white = 0.1;                   ///< m
  double turn_on_bias = 5;              ///< m
  double drift = 0.5;                   ///< Gauss-Markov part, m
  double drift_correlation_time = 300;  ///< s

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("white", self.white, "white height error, m");
    field("turn_on_bias", self.turn_on_bias, "standard deviation of the constant error, m");
    field("drift", self.drift, "standard deviation of the Gauss-Markov error, m");
    field("drift_correlation_time", self.drift_correlation_time, "s");
  }
};

class Barometer {
 public:
  Barometer(const BarometerModel& model, std::uint64_t seed);
  BarometricHeight sample(const KinematicState& truth);

 private:
  BarometerModel model_;
  Random random_;
  double turn_on_bias_ = 0;
  GaussMarkov3 drift_;
  bool started_ = false;
  Time last_;
};

struct MagnetometerModel {
  Eigen::Vector3d world_field{0, 0.2e-4, -0.43e-4};  ///< ENU, tesla (central Europe; declination 0)
  double white = 0.005;                              ///< per axis, relative to the field's norm
  double hard_iron = 0.02;                           ///< constant in body axes, relative to the field's norm

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("field_east", self.world_field[0], "T");
    field("field_north", self.world_field[1], "T");
    field("field_up", self.world_field[2], "T");
    field("white", self.white, "white error per axis, relative to the field");
    field("hard_iron", self.hard_iron,
          "standard deviation of the constant body field, relative to the field");
  }
};

class Magnetometer {
 public:
  Magnetometer(const MagnetometerModel& model, std::uint64_t seed);
  MagneticField sample(const KinematicState& truth);

 private:
  MagnetometerModel model_;
  Random random_;
  Eigen::Vector3d hard_iron_ = Eigen::Vector3d::Zero();
};

}  // namespace pade::simulation
