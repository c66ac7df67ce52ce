// The arithmetic between metres, voxels and tiles.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {

inline bool is_addressed(const VoxelIndex& v) {
  constexpr auto kAll = static_cast<unsigned>(kVoxelsPerAxis);
  return static_cast<unsigned>(v[0]) < kAll && static_cast<unsigned>(v[1]) < kAll &&
         static_cast<unsigned>(v[2]) < kAll;
}

/// The voxel that holds a point, by the arithmetic of OctoMap's coordToKey; false if none does.
inline bool voxel_at(const Eigen::Vector3d& point, double per_voxel, VoxelIndex& v) {
  for (int axis = 0; axis < 3; ++axis) {
    const double index = per_voxel * point[axis] + kTreeCentre;
    if (!(index >= 0 && index < kVoxelsPerAxis)) return false;
    v[static_cast<std::size_t>(axis)] = static_cast<int>(index);
  }
  return true;
}

/// Whether a box holds anything, and no NaN.
inline bool is_box(const Eigen::AlignedBox3d& box) {
  return !box.isEmpty() && !box.min().hasNaN() && !box.max().hasNaN();
}

/// Whether a radius is one.
inline bool is_radius(double radius) { return radius > 0 && std::isfinite(radius); }

/// The same, with the nearest place beyond the border where it cannot be addressed; the point is not NaN.
inline VoxelIndex voxel_beside(const Eigen::Vector3d& point, double voxel) {
  VoxelIndex v{};
  for (int axis = 0; axis < 3; ++axis) {
    const double index = std::floor(1 / voxel * point[axis] + kTreeCentre);
    v[static_cast<std::size_t>(axis)] =
        static_cast<int>(std::clamp(index, -1.0, static_cast<double>(kVoxelsPerAxis)));
  }
  return v;
}

inline std::size_t index_in_tile(const VoxelIndex& v) { return index_in_tile(v[0], v[1], v[2]); }

inline Eigen::Vector3d corner_of(const VoxelIndex& v, double voxel) {
  return voxel * Eigen::Vector3d(v[0] - kTreeCentre, v[1] - kTreeCentre, v[2] - kTreeCentre);
}

inline Eigen::AlignedBox3d box_of(const VoxelIndex& v, double voxel) {
  return {corner_of(v, voxel), corner_of({v[0] + 1, v[1] + 1, v[2] + 1}, voxel)};
}

/// For each tile, which voxels come nearer than `radius` to a path: by tile coordinates, bits as in a Tile.
/// None where the radius is none; segments that lead from or to a point that is not finite are left out.
std::map<VoxelIndex, std::array<std::uint64_t, 8>> voxels_along(std::span<const Eigen::Vector3d> path,
                                                                double radius, double voxel);

}  // namespace pade::mapping
