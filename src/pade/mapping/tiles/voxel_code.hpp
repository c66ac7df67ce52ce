// Places of voxels: by their coordinates, and by the bits of the coordinates interleaved, in the order in
// which OctoMap walks an octree.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

inline constexpr unsigned kTileDepth = kTreeDepth - 3;  // in the octree, of a cube of 8 voxels to a side
inline constexpr int kTreeCentre = 32768;               // coordinate of the voxel just above the origin

/// Coordinates of a voxel, counted from the lower corner of what can be addressed: OctoMap's key.
using VoxelKey = std::array<std::uint16_t, 3>;

/// Bits interleaved, x lowest: sorting by it walks the octree depth first.
std::uint64_t morton_code(const VoxelKey& key);
VoxelKey morton_key(std::uint64_t code);

/// Of the Morton code, below a cube at this depth.
constexpr unsigned bits_below(unsigned depth) { return 3 * (kTreeDepth - depth); }
constexpr std::uint64_t voxels_of(unsigned depth) { return std::uint64_t{1} << bits_below(depth); }

/// The cell of a cube with this Morton code.
MapCell cell_of(std::uint64_t code, unsigned depth, double voxel);

/// The voxel that holds a point, by the arithmetic of OctoMap's coordToKey; false if none does.
/// @param per_voxel  1 / voxel
inline bool key_of(const Eigen::Vector3d& point, double per_voxel, VoxelKey& key) {
  for (int axis = 0; axis < 3; ++axis) {
    const double index = per_voxel * point[axis] + kTreeCentre;
    if (!(index >= 0 && index < 2 * kTreeCentre)) return false;
    key[static_cast<std::size_t>(axis)] = static_cast<std::uint16_t>(index);
  }
  return true;
}

inline Eigen::Vector3d centre_of(const VoxelKey& key, double voxel) {
  return voxel * (Eigen::Vector3d(key[0], key[1], key[2]).array() + (0.5 - kTreeCentre));
}

/// Three bits, two apart.
inline constexpr std::array<std::uint16_t, 8> kSpreadBits{0, 1, 8, 9, 64, 65, 72, 73};

/// Low nine bits of the Morton code of a voxel.
inline std::size_t index_in_tile(int x, int y, int z) {
  return static_cast<std::size_t>(kSpreadBits[static_cast<unsigned>(x) & 7U] |
                                  kSpreadBits[static_cast<unsigned>(y) & 7U] << 1 |
                                  kSpreadBits[static_cast<unsigned>(z) & 7U] << 2);
}

/// The other way round: three bits that lie two apart.
constexpr unsigned gathered_bits(std::size_t spread) {
  return static_cast<unsigned>((spread & 1U) | (spread >> 2U & 2U) | (spread >> 4U & 4U));
}

}  // namespace pade::mapping
