// Which voxels an image, and one of the images before it, show free.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "pade/mapping/clearance.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {

/// Appends what `now` shows free and, unless `alone`, at least one of `earlier` shows free too, in Morton
/// order, as far as it is not in `store` already as free as can be, or all of it if `again`. At most 32
/// earlier ones.
/// @return voxels that `now` alone shows free, likewise; 0 if `alone`
std::size_t find_free(const Clearance& now, std::span<const Clearance* const> earlier, bool alone, bool again,
                      double voxel, const VoxelStore& store, std::vector<FreeCube>& out);

/// Takes `hits` (Morton codes in order) out of the cubes, dividing those that are larger than a tile.
void cut_out(std::vector<FreeCube>& cubes, std::span<const std::uint64_t> hits,
             std::vector<FreeCube>& scratch);

}  // namespace pade::mapping
