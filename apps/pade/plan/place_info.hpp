// What a map says of a place, for `pade info MAP --at`.
#pragma once

#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "pade/mapping/query/map_view.hpp"

namespace pade::cli {

/// "occupied", "free" or "unknown".
const char* state_name(mapping::Occupancy state);

/// State and probability there, the distance of the nearest occupied voxel and the way from it, and the
/// nearest occupied voxel at its height in each of 72 directions.
/// @param reach  of the directions, m
nlohmann::ordered_json place_json(const mapping::MapView& map, const Eigen::Vector3d& place, double reach);
/// The same in a few lines.
std::string place_text(const mapping::MapView& map, const Eigen::Vector3d& place, double reach);

}  // namespace pade::cli
