// From corners to a motion: straight lines and parabolas within limits of speed and acceleration (Kunz and
// Stilman, "Turning paths into trajectories using parabolic blends", 2011).
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::planning {

/// What the vehicle may do.
struct MotionLimits {
  double speed = 2;           ///< m/s
  double acceleration = 1.5;  ///< m/s^2

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("speed", self.speed, "greatest speed, m/s");
    field("acceleration", self.acceleration, "greatest acceleration, m/s^2");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const MotionLimits& limits);

/// A moment of a motion.
struct MotionPoint {
  double time = 0;           ///< since the start, s
  Eigen::Vector3d position;  ///< world, m
  Eigen::Vector3d velocity;  ///< m/s
};

/// The motion from rest at the first corner to rest at the last. A corner is rounded by a parabola that
/// begins and ends on its legs, the sooner the faster.
/// @param corners   no two successive ones at the same place
/// @param rounding  per corner, 0 to 1: how much of half of the shorter leg the parabola may take; 0 = stop
/// there
/// @return points so dense that straight lines between them leave the motion by less than 1 mm
std::vector<MotionPoint> motion_along(std::span<const Eigen::Vector3d> corners,
                                      std::span<const double> rounding, const MotionLimits& limits);

}  // namespace pade::planning
