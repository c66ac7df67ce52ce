// An analytic flight and the sensor data of it: the world in which the filter is tested.
#pragma once

#include <cmath>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/simulation/flight/sensors/aiding.hpp"
#include "pade/simulation/flight/sensors/imu.hpp"

namespace pade::navigation {

/// A smooth loop at up to about 1.5 m/s with banking; at rest until `rest`, then fading in over two seconds.
struct Flight {
  double rest = 4;
  double speed = 1;

  [[nodiscard]] simulation::KinematicState at(double t) const {
    simulation::KinematicState state = pose_at(t);
    constexpr double h = 1e-4;
    const auto before = pose_at(t - h);
    const auto after = pose_at(t + h);
    state.velocity = (after.position - before.position) / (2 * h);
    state.acceleration = (after.position - 2 * state.position + before.position) / (h * h);
    state.angular_velocity =
        rotation_log(Eigen::Quaterniond(before.R_world_body.conjugate() * after.R_world_body)) / (2 * h);
    return state;
  }

 private:
  [[nodiscard]] simulation::KinematicState pose_at(double t) const {
    simulation::KinematicState state;
    state.time = Time::from_seconds(t);
    // Time along the path: 0 at rest, then smoothly up to the clock's rate.
    const double u = std::max(0.0, t - rest);
    const double s = speed * u * u / (u + 2);
    state.position = {4 * std::sin(0.25 * s) + 0.5 * std::sin(0.9 * s), 3 * std::sin(0.4 * s),
                      0.5 * std::sin(0.5 * s)};
    const double yaw = 0.7 + 0.8 * std::sin(0.3 * s);
    const double pitch = 0.15 * std::sin(0.7 * s);
    const double roll = 0.2 * std::sin(0.6 * s);
    state.R_world_body = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
    return state;
  }
};

/// What the sensors show on a flight, with the truth at the IMU's rate.
inline NavigationLog record(const Flight& flight, double duration, const simulation::ImuModel& imu_model,
                            const simulation::GnssModel& gnss_model, std::uint64_t seed, int imu_rate = 200,
                            int gnss_rate = 5) {
  NavigationLog log;
  simulation::Imu imu(imu_model, seed);
  simulation::Gnss gnss(gnss_model, seed + 1000);
  log.gnss.lever_arm = gnss_model.lever_arm;
  const int count = static_cast<int>(duration * imu_rate);
  for (int i = 0; i < count; ++i) {
    const auto state = flight.at(static_cast<double>(i) / imu_rate);
    log.imu.push_back(imu.sample(state));
    log.truth.push_back({state.time, {state.R_world_body, state.position}, state.velocity});
    if (i % (imu_rate / gnss_rate) == 0) {
      const auto epoch = gnss.sample(state);
      log.gnss.fixes.push_back(epoch.fix);
      log.gnss.velocities.push_back(epoch.velocity);
    }
  }
  return log;
}

}  // namespace pade::navigation
