// Between the map and OctoMap's octree.
#pragma once

#include <memory>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

class VoxelStore;

/// All that is known, each cube of one log-odds one leaf.
std::unique_ptr<octomap::OcTree> octree_of(const VoxelStore& store, const MapOptions& options);

/// Takes over all leaves of a tree.
void take_over(const octomap::OcTree& octree, VoxelStore& store);

}  // namespace pade::mapping
