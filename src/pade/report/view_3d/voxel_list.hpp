// The occupied voxels of a map in few bytes, for a page.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// Calls its argument for each known cube of a map: for_each_leaf() of OccupancyMap and of MapView.
using LeafSource = std::function<void(const std::function<void(const mapping::MapLeaf&)>&)>;

/// Cubes that hold something occupied, of 2^`doublings` voxels to a side.
struct VoxelList {
  /// Bits of each cube's key interleaved, x lowest (the voxel's key without its lowest `doublings` bits).
  /// Rising.
  std::vector<std::uint64_t> codes;
  unsigned doublings = 0;
  std::uint64_t voxels = 0;  ///< that are occupied in the map
};

/// All occupied voxels, or, where they are more than `most`, cubes as small as leave `most` at most. Memory:
/// 8 bytes for each of `most`; one pass over the map.
/// @param most  at least 1
VoxelList list_voxels(const LeafSource& leaves, std::size_t most);

/// Each code's step from the one before (from 0 at first), seven bits a byte, lowest first, the eighth set
/// where more follow.
std::vector<unsigned char> encode_voxels(const std::vector<std::uint64_t>& codes);

}  // namespace pade::evaluation
