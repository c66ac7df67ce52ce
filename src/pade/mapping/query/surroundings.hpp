// What lies around a place: the nearest obstacle in each direction, as autopilots take it, and where the
// known space ends.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/mapping/query/map_view.hpp"

namespace pade::mapping {

inline constexpr std::size_t kSectors = 72;  ///< of 5 degrees, as in MAVLink's OBSTACLE_DISTANCE

/// Horizontal distance to the nearest voxel that blocks in each sector, in metres; infinity where there is
/// none. Sector 0 is centred on the world's x axis, the others follow counter-clockwise (towards y). What is
/// not finite (`below` and `above` may be infinite) has something at 0 m all around, and so has, where
/// unknown space blocks, a place that no map can hold.
/// @param place  world, m
/// @param reach  m
/// @param below  of the voxels that count, and
/// @param above  how far they lie from the place, m
std::array<double, kSectors> sectors(const MapView& view, const Eigen::Vector3d& place, double reach,
                                     double below, double above, UnknownSpace unknown);

/// Centres of the free voxels in a box (world, m; none where it is NaN) that share a face with an unknown
/// one, z slowest.
std::vector<Eigen::Vector3d> frontiers(const MapView& view, const Eigen::AlignedBox3d& box);

/// Voxels of a frontier that hang together: by a face, an edge or a corner.
struct FrontierGroup {
  std::size_t voxels = 0;      ///< how many
  Eigen::Vector3d centre;      ///< mean of their centres, world, m
  Eigen::AlignedBox3d bounds;  ///< of their cubes, world, m
};

/// The groups of what frontiers() found, the largest first; of the same size in the order of their first
/// voxels.
/// @param found  centres of voxels, each once
/// @param voxel  side, m
std::vector<FrontierGroup> frontier_groups(std::span<const Eigen::Vector3d> found, double voxel);

}  // namespace pade::mapping
