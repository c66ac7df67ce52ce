// A way through a map that was made before, from a start to a goal, that keeps a ball clear of all that is
// occupied and, unless told otherwise, of all that is unknown. Deterministic: same map, same options, same
// bits.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/planning/global/motion_limits.hpp"

namespace pade::planning {

/// How a route is looked for.
struct RouteOptions {
  double radius = 0.45;  ///< of the ball that stays clear: the vehicle and a margin, m
  mapping::UnknownSpace unknown = mapping::UnknownSpace::blocked;  ///< space that nobody has seen
  int iterations = 20000;   ///< of RRT-Connect, after which there is no route
  int improvements = 2000;  ///< iterations of Informed RRT* for a shorter one; 0 = none
  int seed = 1;             ///< of the random numbers
  MotionLimits motion;      ///< of the vehicle

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("radius", self.radius, "of the ball that stays clear, m");
    field("unknown", self.unknown, "blocked, or free: fly through what nobody has seen");
    field("iterations", self.iterations, "of RRT-Connect, after which there is no route");
    field("improvements", self.improvements, "iterations of Informed RRT* for a shorter route");
    field("seed", self.seed, "of the random numbers");
    field("motion", self.motion, "what the vehicle may do");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const RouteOptions& options);

/// A way that was found.
struct Route {
  std::vector<Eigen::Vector3d> corners;  ///< straight lines between them are clear; world, m
  std::vector<MotionPoint> points;       ///< the same way flown within the limits, corners rounded; clear
  double length = 0;                     ///< of `points`, m
  std::vector<std::string> notes;        ///< what OMPL had to complain about
};

/// Looks for a route. Error if start or goal is occupied, unknown or outside the map, which says which, and
/// if none is found.
/// @param start  world, m
/// @param goal   world, m
/// @param stop   asked now and then; true ends the search as if there were no way
Result<Route> plan_route(const mapping::MapView& view, const Eigen::Vector3d& start,
                         const Eigen::Vector3d& goal, const RouteOptions& options,
                         const std::function<bool()>& stop = {});

}  // namespace pade::planning
