#include "pade/closed_loop/navigated_vehicle.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pade/closed_loop/flight_record.hpp"
#include "pade/core/option_check.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using simulation::KinematicState;

}  // namespace

Status check(const NavigatedVehicleOptions& options) {
  if (const Status s = within("model", simulation::check(options.model)); !s) return s;
  if (const Status s = within("navigation", navigation::check(options.navigation)); !s) return s;
  if (const Status s = within("sensors", simulation::check(options.sensors)); !s) return s;
  if (!options.sensors.enabled)
    return Error{"option sensors.enabled is false, expected true: navigation needs them"};
  constexpr double kRate = 1 / NavigatedVehicle::step;
  const std::array<OptionRange, 2> ranges = {
      {{"imu_rate", options.sensors.imu_rate, kRate, kRate},
       {"gnss_latency", options.sensors.gnss_latency, 0, options.navigation.history}}};
  return within("sensors", check_ranges(ranges));
}

NavigatedVehicle::NavigatedVehicle(const NavigatedVehicleOptions& options, const FaultOptions& faults,
                                   const Vector3d& start, double yaw, std::uint64_t seed)
    : faults_(faults),
      gnss_latency_(options.sensors.gnss_latency),
      vehicle_(options.model, start, yaw),
      sensors_(options.sensors, seed),
      gnss_(options.sensors.gnss_rate),
      barometer_(options.sensors.baro_rate),
      magnetometer_(options.sensors.mag_rate),
      navigator_(options.navigation) {
  measure(-1);
}

/// The instruments show the state that the last step has led to.
void NavigatedVehicle::measure(double flight_time) {
  const KinematicState& truth = vehicle_.state();
  const double time = truth.time.seconds();
  past_.push_back(truth);
  if (past_.size() > static_cast<std::size_t>(remembered / step) + 1) past_.pop_front();
  navigator_.add(sensors_.imu.sample(truth));
  if (gnss_.is_due(time)) {
    const simulation::GnssEpoch epoch = sensors_.gnss.sample(truth);
    if (!faults_.is_on(Fault::gnss_outage, flight_time)) under_way_.push_back(epoch);
  }
  while (!under_way_.empty() && time - under_way_.front().fix.time.seconds() >= gnss_latency_ - 1e-9) {
    navigator_.add(under_way_.front().fix);
    navigator_.add(under_way_.front().velocity);
    under_way_.pop_front();
  }
  if (barometer_.is_due(time)) navigator_.add(sensors_.barometer.sample(truth));
  if (magnetometer_.is_due(time)) {
    MagneticField field = sensors_.magnetometer.sample(truth);
    if (faults_.kind == Fault::compass_error)
      field.field = Eigen::AngleAxisd(faults_.compass_error, Vector3d::UnitZ()) * field.field;
    navigator_.add(field);
  }
}

void NavigatedVehicle::stand() {
  const KinematicState& truth = vehicle_.state();
  simulation::Setpoint here;
  here.position = truth.position;
  here.yaw = yaw_of(truth.R_world_body);
  vehicle_.fly(here, truth, Vector3d::Zero(), step);
  measure(-1);
}

void NavigatedVehicle::believe(const Pose& T_map_smooth) {
  const navigation::AbsolutePose known = navigator_.absolute_pose(vehicle_.state().time);
  if (known.answer != navigation::Answer::valid) return;
  T_map_body_ = T_map_smooth * known.T_smooth_body;
  velocity_sigma_ = std::sqrt(std::max(known.covariance.diagonal().segment<3>(3).maxCoeff(), 0.0));
  map_velocity_ = T_map_body_.rotation * (known.T_world_body.rotation.conjugate() * known.velocity);
}

/// Errors of place and velocity are seen from the believed attitude and corrected from the true one.
void NavigatedVehicle::fly(const simulation::Setpoint& setpoint, const Pose& T_map_smooth,
                           double flight_time) {
  believe(T_map_smooth);
  const KinematicState& truth = vehicle_.state();
  const Pose T_world_map = Pose{truth.R_world_body, truth.position} * T_map_body_.inverse();
  simulation::Setpoint asked;
  asked.position = T_world_map * setpoint.position;
  asked.velocity = T_world_map.rotation * setpoint.velocity;
  asked.acceleration = T_world_map.rotation * setpoint.acceleration;
  asked.yaw = setpoint.yaw + yaw_of(T_world_map.rotation);
  KinematicState believed = truth;
  believed.velocity = T_world_map.rotation * map_velocity_;
  const Vector3d nose = truth.R_world_body * Vector3d::UnitX();
  const Vector3d side = Vector3d(-nose.y(), nose.x(), 0).normalized();
  const Vector3d wind =
      faults_.is_on(Fault::gust, flight_time) ? Vector3d(faults_.gust * side) : Vector3d(Vector3d::Zero());
  vehicle_.fly(asked, believed, wind, step);
  measure(flight_time);
}

KinematicState NavigatedVehicle::truth_before(double seconds) const {
  const auto back = static_cast<std::size_t>(std::lround(std::max(seconds, 0.0) / step));
  return past_[past_.size() - 1 - std::min(back, past_.size() - 1)];
}

}  // namespace pade::closed_loop
