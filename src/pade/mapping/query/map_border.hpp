// Where a map ends.
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

/// Whether what a camera sees from a place, up to 200 m away, may lie where no map can hold it: 32768 voxels
/// from its origin (MapChange::outside). A new map is then begun around the place.
/// @param place  in the map's world, m. @param voxel  m
inline bool is_near_the_border(const Eigen::Vector3d& place, double voxel) {
  constexpr double kReach = 200;  // m
  const double half = voxel * (1 << (kTreeDepth - 1));
  return place.allFinite() && place.cwiseAbs().maxCoeff() > half - std::min(kReach, half / 2);
}

}  // namespace pade::mapping
