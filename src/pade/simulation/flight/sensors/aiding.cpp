#include "pade/simulation/flight/sensors/aiding.hpp"

namespace pade::simulation {
namespace {

/// Seconds since the last call, and 0 at the first.
double elapsed(bool& started, Time& last, Time now) {
  const double dt = started ? seconds_between(last, now) : 0;
  started = true;
  last = now;
  return dt > 0 ? dt : 0;
}

}  // namespace

GnssModel GnssModel::carrier_phase() {
  GnssModel model;
  model.white_horizontal = 0.01;
  model.white_vertical = 0.02;
  model.bias_horizontal = 0.005;
  model.bias_vertical = 0.01;
  model.bias_correlation_time = 60;
  model.velocity_horizontal = 0.03;
  model.velocity_vertical = 0.05;
  return model;
}

Gnss::Gnss(const GnssModel& model, std::uint64_t seed)
    : model_(model),
      random_(seed),
      bias_({model.bias_horizontal, model.bias_horizontal, model.bias_vertical}, model.bias_correlation_time,
            random_) {}

GnssEpoch Gnss::sample(const KinematicState& truth) {
  const double dt = elapsed(started_, last_, truth.time);
  bias_.step(dt, random_);
  const Eigen::Vector3d white(model_.white_horizontal, model_.white_horizontal, model_.white_vertical);
  const Eigen::Vector3d bias(model_.bias_horizontal, model_.bias_horizontal, model_.bias_vertical);
  const Eigen::Vector3d doppler(model_.velocity_horizontal, model_.velocity_horizontal,
                                model_.velocity_vertical);

  GnssEpoch epoch;
  epoch.fix.time = epoch.velocity.time = truth.time;
  epoch.fix.position = truth.position + truth.R_world_body * model_.lever_arm + bias_.value() +
                       white.cwiseProduct(random_.normal3());
  epoch.fix.covariance = (white.cwiseAbs2() + bias.cwiseAbs2()).asDiagonal();
  epoch.velocity.velocity = truth.velocity +
                            truth.R_world_body * truth.angular_velocity.cross(model_.lever_arm) +
                            doppler.cwiseProduct(random_.normal3());
  epoch.velocity.covariance = doppler.cwiseAbs2().asDiagonal();
  // Drawn always, so that switching outliers on does not change the other noise.
  const bool outlier = random_.uniform() < model_.outlier_fraction;
  const Eigen::Vector3d wrong_position = model_.outlier_position * random_.normal3();
  const Eigen::Vector3d wrong_velocity = model_.outlier_velocity * random_.normal3();
  if (outlier) {
    epoch.fix.position += wrong_position;
    epoch.velocity.velocity += wrong_velocity;
  }
  return epoch;
}

Barometer::Barometer(const BarometerModel& model, std::uint64_t seed)
    : model_(model),
      random_(seed),
      turn_on_bias_(model.turn_on_bias * random_.normal()),
      drift_(Eigen::Vector3d::Constant(model.drift), model.drift_correlation_time, random_) {}

BarometricHeight Barometer::sample(const KinematicState& truth) {
  const double dt = elapsed(started_, last_, truth.time);
  const double drift = drift_.step(dt, random_).x();
  return {truth.time, truth.position.z() + turn_on_bias_ + drift + model_.white * random_.normal(),
          model_.white};
}

Magnetometer::Magnetometer(const MagnetometerModel& model, std::uint64_t seed)
    : model_(model),
      random_(seed),
      hard_iron_(model.hard_iron * model.world_field.norm() * random_.normal3()) {}

MagneticField Magnetometer::sample(const KinematicState& truth) {
  const double norm = model_.world_field.norm();
  MagneticField sample;
  sample.time = truth.time;
  sample.field = truth.R_world_body.conjugate() * model_.world_field + hard_iron_ +
                 model_.white * norm * random_.normal3();
  sample.sigma = std::hypot(model_.white, model_.hard_iron);
  return sample;
}

}  // namespace pade::simulation
