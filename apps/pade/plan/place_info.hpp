// What a map says of a place, for `pade info MAP --at`.
#pragma once

#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::cli {

/// State and probability there, the distance of the nearest occupied voxel and the way from it, and the
/// nearest obstacle at its height in each of 72 directions.
nlohmann::ordered_json place_json(const mapping::OccupancyMap& map, const Eigen::Vector3d& place);
/// The same in a few lines.
std::string place_text(const mapping::OccupancyMap& map, const Eigen::Vector3d& place);

}  // namespace pade::cli
