// The search for a path of straight lines, by OMPL (Sucan, Moll, Kavraki, "The Open Motion Planning Library",
// 2012): RRT-Connect for any path, Informed RRT* for a short one, both shortened.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/planning/global/route.hpp"

namespace pade::planning {

struct FoundPath {
  std::vector<Eigen::Vector3d> corners;  ///< empty if there is none
  std::vector<std::string> complaints;   ///< of OMPL
};

/// @param margin  added to the radius, m
/// @param stop    asked now and then; true ends the search. May be empty
FoundPath search_path(const mapping::MapView& view, const Eigen::Vector3d& start, const Eigen::Vector3d& goal,
                      const RouteOptions& options, double margin, const std::function<bool()>& stop);

}  // namespace pade::planning
