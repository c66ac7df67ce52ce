#include "pade/simulation/flight/vehicle.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pade/core/option_check.hpp"
#include "pade/core/pose.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

/// Body axes with z along the thrust and the nose, seen from above, at `yaw`.
Eigen::Quaterniond attitude_of(const Vector3d& thrust, double yaw) {
  const Vector3d z = thrust.normalized();
  const Vector3d heading(std::cos(yaw), std::sin(yaw), 0);
  const Vector3d y = z.cross(heading).normalized();
  Eigen::Matrix3d axes;
  axes << y.cross(z), y, z;
  return Eigen::Quaterniond(axes);
}

Vector3d shortened(const Vector3d& v, double most) {
  const double size = v.norm();
  return size > most ? Vector3d(most / size * v) : v;
}

}  // namespace

Status check(const VehicleModel& model) {
  const std::array<OptionRange, 11> ranges = {{{"attitude_lag", model.attitude_lag, 0.01, 10},
                                               {"rate_lag", model.rate_lag, 0.005, 10},
                                               {"thrust_lag", model.thrust_lag, 0.01, 10},
                                               {"drag", model.drag, 0, 10},
                                               {"tilt", model.tilt, 0.05, 1.2},
                                               {"turn_rate", model.turn_rate, 0.1, 50},
                                               {"thrust", model.thrust, model.gravity, 500},
                                               {"position_gain", model.position_gain, 0, 20},
                                               {"velocity_gain", model.velocity_gain, 0, 20},
                                               {"integral_gain", model.integral_gain, 0, 20},
                                               {"gravity", model.gravity, above_zero, 100}}};
  return check_ranges(ranges);
}

Vehicle::Vehicle(const VehicleModel& model, const Vector3d& position, double yaw)
    : model_(model), thrust_(model.gravity) {
  state_.position = position;
  state_.R_world_body = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
}

Vector3d Vehicle::asked_thrust(const Setpoint& setpoint, const KinematicState& believed) const {
  constexpr double kMostCorrection = 1;  // m/s, however far it is from where it should be
  const Vector3d velocity =
      setpoint.velocity +
      shortened(model_.position_gain * (setpoint.position - believed.position), kMostCorrection);
  Vector3d thrust = setpoint.acceleration + steady_ + model_.velocity_gain * (velocity - believed.velocity) +
                    model_.drag * setpoint.velocity + model_.gravity * Vector3d::UnitZ();
  thrust.z() = std::max(thrust.z(), 0.3 * model_.gravity);
  const Vector3d level(thrust.x(), thrust.y(), 0);
  const Vector3d tilted = shortened(level, thrust.z() * std::tan(model_.tilt));
  return shortened(tilted + thrust.z() * Vector3d::UnitZ(), model_.thrust);
}

void Vehicle::fly(const Setpoint& setpoint, const KinematicState& believed, const Vector3d& wind,
                  double step) {
  constexpr double kMostOffset = 0.5;  // m: what is farther off has not been pushed there
  constexpr double kMostSteady = 3;    // m/s^2
  const Vector3d offset = shortened(setpoint.position - believed.position, kMostOffset);
  steady_ = shortened(steady_ + step * model_.integral_gain * offset, kMostSteady);
  const Vector3d asked = asked_thrust(setpoint, believed);
  const Eigen::Quaterniond error = state_.R_world_body.conjugate() * attitude_of(asked, setpoint.yaw);
  const KinematicState before = state_;
  const auto share = [step](double lag) { return 1 - std::exp(-step / lag); };
  const Vector3d rate = shortened(rotation_log(error) / model_.attitude_lag, model_.turn_rate);
  state_.angular_velocity += share(model_.rate_lag) * (rate - before.angular_velocity);
  // Rates and accelerations are those of the moment, as instruments see them; between two moments they are
  // linear.
  const Vector3d turn = 0.5 * step * (before.angular_velocity + state_.angular_velocity);
  state_.R_world_body = (before.R_world_body * rotation_exp(turn)).normalized();
  thrust_ += share(model_.thrust_lag) * (std::clamp(asked.norm(), 0.0, model_.thrust) - thrust_);
  state_.acceleration = thrust_ * (state_.R_world_body * Vector3d::UnitZ()) -
                        model_.gravity * Vector3d::UnitZ() - model_.drag * (before.velocity - wind);
  state_.velocity += 0.5 * step * (before.acceleration + state_.acceleration);
  state_.position +=
      step * before.velocity + step * step * (before.acceleration / 3 + state_.acceleration / 6);
  state_.time = Time{state_.time.nanoseconds + std::llround(step * 1e9)};
}

}  // namespace pade::simulation
