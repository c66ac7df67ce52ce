// A quadrotor that is flown step by step: it tilts, with a lag, to where its thrust has to point, and the air
// brakes and pushes it. What it does follows from its commands, not from a path known in advance.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/flight/sensors/kinematics.hpp"

namespace pade::simulation {

struct VehicleModel {
  double attitude_lag = 0.12;  ///< time constant of the attitude, s
  double rate_lag = 0.04;      ///< of the angular rate, s
  double thrust_lag = 0.05;    ///< of the thrust, s
  double drag = 0.3;           ///< deceleration over speed through the air, 1/s
  double tilt = 0.6;           ///< greatest that is commanded, rad
  double turn_rate = 4;        ///< greatest angular rate, rad/s
  double thrust = 20;          ///< greatest per mass, m/s^2
  double position_gain = 1.5;  ///< velocity that an error of position asks for, 1/s
  double velocity_gain = 3;    ///< acceleration that an error of velocity asks for, 1/s
  double integral_gain = 2;    ///< acceleration that an error of position asks for while it lasts, 1/s^3
  double gravity = 9.80665;    ///< m/s^2

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("attitude_lag", self.attitude_lag, "time constant of the attitude, s");
    field("rate_lag", self.rate_lag, "time constant of the angular rate, s");
    field("thrust_lag", self.thrust_lag, "time constant of the thrust, s");
    field("drag", self.drag, "deceleration over speed through the air, 1/s");
    field("tilt", self.tilt, "greatest tilt that is commanded, rad");
    field("turn_rate", self.turn_rate, "greatest angular rate, rad/s");
    field("thrust", self.thrust, "greatest thrust per mass, m/s^2");
    field("position_gain", self.position_gain, "velocity that an error of position asks for, 1/s");
    field("velocity_gain", self.velocity_gain, "acceleration that an error of velocity asks for, 1/s");
    field("integral_gain", self.integral_gain,
          "acceleration that an error of position asks for while it lasts, 1/s^3");
    field("gravity", self.gravity, "m/s^2, downwards");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const VehicleModel& model);

/// What the vehicle is to do now.
struct Setpoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< world, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s^2
  double yaw = 0;                                          ///< of the nose from east toward north, rad
};

/// The vehicle and its controller, which knows its own state as `believed` says.
class Vehicle {
 public:
  /// Hovers at a place. `model` as check() accepts it.
  Vehicle(const VehicleModel& model, const Eigen::Vector3d& position, double yaw);

  /// The true state; its acceleration and angular velocity are those of this moment.
  [[nodiscard]] const KinematicState& state() const { return state_; }

  /// Flies `step` seconds (some milliseconds) toward a setpoint.
  /// @param believed  position and velocity as the vehicle's navigation has them, else the true ones
  /// @param wind      of the air over the ground, m/s
  void fly(const Setpoint& setpoint, const KinematicState& believed, const Eigen::Vector3d& wind,
           double step);

 private:
  [[nodiscard]] Eigen::Vector3d asked_thrust(const Setpoint& setpoint, const KinematicState& believed) const;

  VehicleModel model_;
  KinematicState state_;
  Eigen::Vector3d steady_ = Eigen::Vector3d::Zero();  // m/s^2, against what has pushed it aside so far
  double thrust_;                                     // along body z, per mass
};

}  // namespace pade::simulation
