// The voxels around the vehicle that sectors are made of.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "pade/live/sectors.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::live {

/// A box of voxels.
struct Reach {
  mapping::VoxelIndex low, high;  ///< both ends included; also of voxels that no map can address
  bool addressed = true;          ///< a map can address all of them

  /// What lies within SectorOptions::max_distance of a place, and not below or above it by more than the
  /// slab. Never shortened to what a map holds: of what lies beyond nothing is known, which must be said.
  /// Empty where even the numbers end.
  /// @param place  in the map's world, m. @param voxel  m
  static std::optional<Reach> around(const Eigen::Vector3d& place, const SectorOptions& options,
                                     double voxel) {
    constexpr double kFarthest = 1 << 28;  // voxels: far from where sums of int end
    const double reach = options.max_distance;
    const Eigen::Vector3d corners[] = {place - Eigen::Vector3d(reach, reach, options.below),
                                       place + Eigen::Vector3d(reach, reach, options.above)};
    Reach found;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const Eigen::Vector3d& corner : corners) {
        const double index =
            std::floor(1 / voxel * corner[static_cast<Eigen::Index>(axis)] + mapping::kTreeCentre);
        if (!(std::abs(index) < kFarthest)) return std::nullopt;
        (&corner == corners ? found.low : found.high)[axis] = static_cast<int>(index);
      }
    }
    found.addressed = mapping::is_addressed(found.low) && mapping::is_addressed(found.high);
    return found;
  }
};

}  // namespace pade::live
