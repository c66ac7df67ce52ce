// The map as octomap_server publishes it.
#pragma once

#include <memory>
#include <string>

#include <pade/mapping/query/map_view.hpp>

#include "bridge.hpp"

namespace pade_ros {

/// What is wanted of a map. A view holds log-odds to 0.5 % of their range, which `full` therefore does.
/// @param least_z  of what the map from above shows, m; `most_z` the same
MapResult map_content(const pade::mapping::MapView& view, const Wanted& wanted, double least_z,
                      double most_z);

}  // namespace pade_ros
