// A strapdown inertial measurement unit: IEEE Std 952 error model (angle and velocity random walk, bias
// instability as a Gauss-Markov process, rate random walk), turn-on bias, scale and alignment errors, rotor
// vibration, saturation and quantisation.
#pragma once

#include <cstdint>

#include "pade/core/random.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/simulation/flight/sensors/kinematics.hpp"
#include "pade/simulation/flight/sensors/noise.hpp"

namespace pade::simulation {

/// The errors of one triad (three gyroscopes or three accelerometers); `unit` is rad/s or m/s².
struct TriadErrors {
  double noise_density = 0;          ///< unit/sqrt(Hz)
  double turn_on_bias = 0;           ///< standard deviation per axis, constant in a run, unit
  double bias_instability = 0;       ///< stationary standard deviation of the Gauss-Markov part, unit
  double bias_correlation_time = 0;  ///< of the Gauss-Markov part, s
  double random_walk = 0;            ///< of the bias, unit*sqrt(Hz) (unit per square root of second)
  double scale_factor = 0;           ///< standard deviation, relative
  double misalignment = 0;           ///< standard deviation of each off-diagonal element, rad
  double range = 0;                  ///< saturation, unit; 0 = none
  double resolution = 0;             ///< quantisation step, unit; 0 = none

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("noise_density", self.noise_density, "white noise, unit/sqrt(Hz)");
    field("turn_on_bias", self.turn_on_bias, "standard deviation of the constant bias, unit");
    field("bias_instability", self.bias_instability, "standard deviation of the Gauss-Markov bias, unit");
    field("bias_correlation_time", self.bias_correlation_time, "of the Gauss-Markov bias, s");
    field("random_walk", self.random_walk, "random walk of the bias, unit/sqrt(s)");
    field("scale_factor", self.scale_factor, "standard deviation of the scale error, relative");
    field("misalignment", self.misalignment, "standard deviation of each axis misalignment, rad");
    field("range", self.range, "saturation, unit; 0 = none");
    field("resolution", self.resolution, "quantisation step, unit; 0 = none");
  }
};

struct ImuModel {
  TriadErrors gyroscope;
  TriadErrors accelerometer;
  double gravity = 9.80665;  ///< m/s², along world -z
  double vibration = 0;      ///< rms of the rotor vibration in specific force, per axis, m/s²
  double vibration_frequency =
      0;  ///< Hz; aliases where it is above half the sampling rate, as it does in flight

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("gyroscope", self.gyroscope, "errors of the gyroscopes, rad/s");
    field("accelerometer", self.accelerometer, "errors of the accelerometers, m/s²");
    field("gravity", self.gravity, "m/s², downwards");
    field("vibration", self.vibration, "rms of the rotor vibration, m/s²");
    field("vibration_frequency", self.vibration_frequency, "Hz");
  }

  /// A perfect instrument.
  static ImuModel perfect() { return {}; }
  /// The industrial MEMS of research vehicles (data sheet of the ADIS16448).
  static ImuModel industrial();
  /// The MEMS of hobby autopilots (data sheet of the ICM-20602 class).
  static ImuModel consumer();
};

/// A seeded instrument: call `sample` at the sampling times in order.
class Imu {
 public:
  Imu(const ImuModel& model, std::uint64_t seed);

  /// What the instrument shows at `truth.time`. The noise of a sample is that of an average over the time
  /// since the last sample (the first: 5 ms).
  ImuSample sample(const KinematicState& truth);

  [[nodiscard]] Eigen::Vector3d gyroscope_bias() const { return gyroscope_.bias(); }
  [[nodiscard]] Eigen::Vector3d accelerometer_bias() const { return accelerometer_.bias(); }

 private:
  class Triad {
   public:
    Triad(const TriadErrors& errors, Random& random);
    Eigen::Vector3d sample(const Eigen::Vector3d& truth, double dt, Random& random);
    [[nodiscard]] Eigen::Vector3d bias() const { return turn_on_bias_ + instability_.value() + walk_; }

   private:
    TriadErrors errors_;
    Eigen::Matrix3d gain_ = Eigen::Matrix3d::Identity();
    Eigen::Vector3d turn_on_bias_ = Eigen::Vector3d::Zero();
    GaussMarkov3 instability_;
    Eigen::Vector3d walk_ = Eigen::Vector3d::Zero();
  };

  ImuModel model_;
  Random random_;
  Triad gyroscope_;
  Triad accelerometer_;
  Eigen::Vector3d vibration_phase_ = Eigen::Vector3d::Zero();
  bool started_ = false;
  Time last_;
};

}  // namespace pade::simulation
