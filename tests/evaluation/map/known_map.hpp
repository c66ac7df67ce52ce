// Maps whose content is known: boxes that are free or occupied.
#pragma once

#include <memory>
#include <utility>

#include <octomap/OcTree.h>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::test {

/// Fills the voxels of 0.1 m between two corners, both included as places in a voxel.
inline void fill(octomap::OcTree& tree, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                 bool occupied) {
  octomap::OcTreeKey low, high;
  tree.coordToKeyChecked(octomap::point3d(static_cast<float>(from.x()), static_cast<float>(from.y()),
                                          static_cast<float>(from.z())),
                         low);
  tree.coordToKeyChecked(
      octomap::point3d(static_cast<float>(to.x()), static_cast<float>(to.y()), static_cast<float>(to.z())),
      high);
  for (unsigned x = low[0]; x <= high[0]; ++x) {
    for (unsigned y = low[1]; y <= high[1]; ++y) {
      for (unsigned z = low[2]; z <= high[2]; ++z) {
        tree.setNodeValue(
            octomap::OcTreeKey(static_cast<octomap::key_type>(x), static_cast<octomap::key_type>(y),
                               static_cast<octomap::key_type>(z)),
            occupied ? 2.0F : -2.0F, true);
      }
    }
  }
}

/// Free from x = 0 to `length` within 1.5 m of the x axis, a wall of 0.2 m behind it.
inline mapping::OccupancyMap free_lane(double length) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  fill(*tree, {0.05, -1.45, -1.45}, {length - 0.05, 1.45, 1.45}, false);
  fill(*tree, {length + 0.05, -1.45, -1.45}, {length + 0.15, 1.45, 1.45}, true);
  tree->updateInnerOccupancy();
  tree->prune();
  return std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
}

}  // namespace pade::test
