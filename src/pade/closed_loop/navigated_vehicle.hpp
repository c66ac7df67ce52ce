// A vehicle that knows of itself what its instruments tell its navigation filter, and flies by that.
#pragma once

#include <cstdint>
#include <deque>

#include "pade/closed_loop/faults.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/flight/sensor_suite.hpp"
#include "pade/simulation/flight/vehicle.hpp"

namespace pade::closed_loop {

/// What it is made of.
struct NavigatedVehicleOptions {
  simulation::VehicleModel model;
  simulation::SensorOptions sensors;
  navigation::NavigatorOptions navigation;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("model", self.model, "how the vehicle moves");
    field("sensors", self.sensors, "its instruments");
    field("navigation", self.navigation, "the filter that reads them");
  }
};

/// Refuses numbers that make no sense, and those of instruments that no flight in a closed loop has
/// (core/option_check.hpp).
Status check(const NavigatedVehicleOptions& options);

class NavigatedVehicle {
 public:
  static constexpr double step = 0.005;      ///< s: of the motion and of the fastest instrument
  static constexpr double remembered = 0.2;  ///< s: how far back the truth can be asked for

  /// Stands at a place, which it need not know.
  NavigatedVehicle(const NavigatedVehicleOptions& options, const FaultOptions& faults,
                   const Eigen::Vector3d& start, double yaw, std::uint64_t seed);

  /// Stands still for a step.
  void stand();
  /// Flies a step toward a setpoint in the world of the map.
  /// @param T_map_smooth  from the filter's smooth world (AbsolutePose::T_smooth_body) to the map's
  /// @param flight_time   s since take-off, for the faults
  void fly(const simulation::Setpoint& setpoint, const Pose& T_map_smooth, double flight_time);

  [[nodiscard]] const simulation::KinematicState& truth() const { return vehicle_.state(); }
  /// The true pose of the body some time ago, at most `remembered`.
  [[nodiscard]] simulation::KinematicState truth_before(double seconds) const;
  [[nodiscard]] navigation::Navigator& navigator() { return navigator_; }
  /// Where it believes itself in the map's world, as of the last step; the attitude is the believed one.
  [[nodiscard]] const Pose& believed() const { return T_map_body_; }
  [[nodiscard]] const Eigen::Vector3d& believed_velocity() const { return map_velocity_; }
  /// How sure it is of its velocity, as of the last step: of the axis that it knows least of, m/s, 1 sigma.
  [[nodiscard]] double velocity_sigma() const { return velocity_sigma_; }

 private:
  void measure(double flight_time);
  void believe(const Pose& T_map_smooth);

  FaultOptions faults_;
  double gnss_latency_;
  std::deque<simulation::GnssEpoch> under_way_;  // measured, not yet arrived
  simulation::Vehicle vehicle_;
  simulation::SensorSuite sensors_;
  simulation::SampleClock gnss_, barometer_, magnetometer_;
  navigation::Navigator navigator_;
  std::deque<simulation::KinematicState> past_;
  Pose T_map_body_;
  Eigen::Vector3d map_velocity_ = Eigen::Vector3d::Zero();
  double velocity_sigma_ = 0;
};

}  // namespace pade::closed_loop
