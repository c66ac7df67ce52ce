// How the vehicle moves when it is told a speed, a yaw rate and a climb: what the local planner foretells and
// the vehicle's controller follows.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "pade/planning/local_options.hpp"

namespace pade::planning {

/// A moment of the motion. World ENU; the body stays level as far as the planner is concerned.
struct MotionState {
  double time = 0;                                     ///< s
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s
  double yaw = 0;                                      ///< of the nose from east toward north, rad
};

/// What is asked for until it is asked to stop.
struct MotionCommand {
  double forward = 0;   ///< m/s along the nose, level
  double left = 0;      ///< m/s
  double climb = 0;     ///< m/s
  double yaw_rate = 0;  ///< rad/s
  double swing = 0;     ///< amplitude of the swing to the sides, m; its period is 2 s of the state's time
};

/// The motion under a command that ends in a stop: the velocity turns into the one asked for as fast as the
/// pick-up allows, and ends as fast as the acceleration does; the yaw rate is there at once.
/// @param hold  seconds for which the command holds; then the vehicle brakes
/// @param step  between the states, s
/// @param out   emptied, then filled from `from` to the standstill
void foretell(const MotionState& from, const MotionCommand& command, double hold, double step,
              const VehicleLimits& limits, std::vector<MotionState>& out);

/// The state at a time, between the two that surround it; the last one, at rest, after the end. Not empty.
MotionState state_at(std::span<const MotionState> motion, double time);

/// Greatest speed from which a stop within `free_reach` metres is possible: v = -a tau + sqrt(a^2 tau^2 + 2 a
/// L).
double governed_speed(double free_reach, const VehicleLimits& limits);

/// An angle in (-pi, pi].
double wrapped(double angle);

}  // namespace pade::planning
