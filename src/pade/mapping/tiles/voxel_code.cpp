#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {
namespace {

/// Spreads 16 bits to every third bit.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 16U) & 0x0000ff0000ffU;
  x = (x | x << 8U) & 0x00f00f00f00fU;
  x = (x | x << 4U) & 0x0c30c30c30c3U;
  x = (x | x << 2U) & 0x249249249249U;
  return x;
}

std::uint16_t gather(std::uint64_t x) {
  x &= 0x249249249249U;
  x = (x | x >> 2U) & 0x0c30c30c30c3U;
  x = (x | x >> 4U) & 0x00f00f00f00fU;
  x = (x | x >> 8U) & 0x0000ff0000ffU;
  x = (x | x >> 16U) & 0x00000000ffffU;
  return static_cast<std::uint16_t>(x);
}

}  // namespace

std::uint64_t morton_code(const VoxelKey& key) {
  return spread(key[0]) | spread(key[1]) << 1U | spread(key[2]) << 2U;
}

VoxelKey morton_key(std::uint64_t code) { return {gather(code), gather(code >> 1U), gather(code >> 2U)}; }

MapCell cell_of(std::uint64_t code, unsigned depth, double voxel) {
  MapCell cell;
  cell.key = morton_key(code);
  cell.depth = depth;
  const double voxels = static_cast<double>(1U << (kTreeDepth - depth));
  for (unsigned axis = 0; axis < 3; ++axis) {
    cell.centre[static_cast<int>(axis)] =
        static_cast<float>((static_cast<double>(cell.key[axis]) - kTreeCentre + 0.5 * voxels) * voxel);
  }
  cell.side = static_cast<float>(voxels * voxel);
  return cell;
}

}  // namespace pade::mapping
