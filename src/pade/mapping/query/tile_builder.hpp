// Makes trees of tiles from the voxels of a map, whole or where it has changed, and trees with other tiles in
// some places.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "pade/mapping/query/tile_tree.hpp"

namespace pade::mapping {

class VoxelStore;

/// A cube of the octree by the Morton code of its lower corner.
struct TouchedCube {
  std::uint64_t code = 0;
  unsigned depth = 0;
};

/// Nothing is known.
TileTree empty_tiles(const VoxelStore& voxels, double voxel);

/// The tree with the cubes taken from the map anew.
/// @param touched  in Morton order, disjoint
/// @param window   in tiles; outside all is unknown
TileTree rebuilt(TileTree tiles, const VoxelStore& voxels, std::span<const TouchedCube> touched,
                 const TileBounds& window);

/// The tile with the unknown ones of some voxels (words as in Tile) as free as can be.
std::shared_ptr<const Tile> with_free(const Tile& old, const std::array<std::uint64_t, 8>& words);

/// The tree with other tiles in some places (tile coordinates, each once).
TileTree with_tiles(TileTree tiles, std::vector<std::pair<VoxelIndex, std::shared_ptr<const Tile>>> changed);

/// The tiles that a box (world, m) touches, as far as they can be addressed.
TileBounds tiles_of(const Eigen::AlignedBox3d& box, double voxel);

}  // namespace pade::mapping
