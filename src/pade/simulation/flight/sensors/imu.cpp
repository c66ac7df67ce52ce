#include "pade/simulation/flight/sensors/imu.hpp"

#include <algorithm>
#include <numbers>

namespace pade::simulation {
namespace {
constexpr double kFirstInterval = 0.005;
constexpr double kDegree = std::numbers::pi / 180;
}  // namespace

ImuModel ImuModel::industrial() {
  ImuModel model;
  model.gyroscope = {.noise_density = 0.0135 * kDegree,  // data sheet: 0.0135 °/s/sqrt(Hz)
                     .turn_on_bias = 0.5 * kDegree,
                     .bias_instability = 14.5 / 3600 * kDegree,
                     .bias_correlation_time = 300,
                     .random_walk = 2e-5,
                     .scale_factor = 1e-3,
                     .misalignment = 1e-3,
                     .range = 1000 * kDegree,
                     .resolution = 0.04 * kDegree};
  model.accelerometer = {.noise_density = 2.3e-3,  // 0.23 mg/sqrt(Hz)
                         .turn_on_bias = 0.05,
                         .bias_instability = 0.25e-3 * 9.80665,
                         .bias_correlation_time = 300,
                         .random_walk = 2e-4,
                         .scale_factor = 1e-3,
                         .misalignment = 1e-3,
                         .range = 18 * 9.80665,
                         .resolution = 0.833e-3 * 9.80665};
  model.vibration = 0.3;
  model.vibration_frequency = 87;
  return model;
}

ImuModel ImuModel::consumer() {
  ImuModel model = industrial();
  model.gyroscope.noise_density = 0.004 * kDegree;
  model.gyroscope.turn_on_bias = 1.0 * kDegree;
  model.gyroscope.bias_instability = 10.0 / 3600 * kDegree;
  model.gyroscope.random_walk = 5e-5;
  model.gyroscope.scale_factor = 5e-3;
  model.gyroscope.misalignment = 5e-3;
  model.gyroscope.resolution = 1 / 16.4 * kDegree;
  model.accelerometer.noise_density = 1e-3;
  model.accelerometer.turn_on_bias = 0.2;
  model.accelerometer.bias_instability = 1e-3;
  model.accelerometer.random_walk = 5e-4;
  model.accelerometer.scale_factor = 5e-3;
  model.accelerometer.misalignment = 5e-3;
  model.accelerometer.range = 16 * 9.80665;
  model.accelerometer.resolution = 9.80665 / 2048;
  return model;
}

Imu::Triad::Triad(const TriadErrors& errors, Random& random) : errors_(errors) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      gain_(row, column) += (row == column ? errors.scale_factor : errors.misalignment) * random.normal();
    }
  }
  turn_on_bias_ = errors.turn_on_bias * random.normal3();
  instability_ =
      GaussMarkov3(Eigen::Vector3d::Constant(errors.bias_instability), errors.bias_correlation_time, random);
}

Eigen::Vector3d Imu::Triad::sample(const Eigen::Vector3d& truth, double dt, Random& random) {
  instability_.step(dt, random);
  walk_ += errors_.random_walk * std::sqrt(dt) * random.normal3();
  Eigen::Vector3d value = gain_ * truth + bias() + white_sigma(errors_.noise_density, dt) * random.normal3();
  for (double& x : value) {
    if (errors_.range > 0) x = std::clamp(x, -errors_.range, errors_.range);
    if (errors_.resolution > 0) x = std::round(x / errors_.resolution) * errors_.resolution;
  }
  return value;
}

Imu::Imu(const ImuModel& model, std::uint64_t seed)
    : model_(model),
      random_(seed),
      gyroscope_(model.gyroscope, random_),
      accelerometer_(model.accelerometer, random_) {
  for (double& phase : vibration_phase_) phase = random_.uniform(0, 2 * std::numbers::pi);
}

ImuSample Imu::sample(const KinematicState& truth) {
  const double since_last = started_ ? seconds_between(last_, truth.time) : kFirstInterval;
  const double dt = since_last > 0 ? since_last : kFirstInterval;
  started_ = true;
  last_ = truth.time;
  Eigen::Vector3d force =
      truth.R_world_body.conjugate() * (truth.acceleration + Eigen::Vector3d(0, 0, model_.gravity));
  const double angle = 2 * std::numbers::pi * model_.vibration_frequency * truth.time.seconds();
  for (int axis = 0; axis < 3; ++axis) {
    force[axis] += model_.vibration * std::numbers::sqrt2 * std::sin(angle + vibration_phase_[axis]);
  }
  ImuSample sample;
  sample.time = truth.time;
  sample.angular_rate = gyroscope_.sample(truth.angular_velocity, dt, random_);
  sample.specific_force = accelerometer_.sample(force, dt, random_);
  return sample;
}

}  // namespace pade::simulation
