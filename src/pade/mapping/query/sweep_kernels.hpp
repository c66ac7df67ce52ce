// Which voxels of a tile a moving ball may meet: compiled once per instruction set.
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::mapping {

/// A ball on its path, m, and the voxels of a tile by the centre of the first of them from where the path
/// begins.
struct BallInTile {
  float direction[3];  // NOLINT(*-avoid-c-arrays)
  float length, radius;
  float voxel;
  float first[3];  // NOLINT(*-avoid-c-arrays)
};

PADE_DECLARE_KERNEL(
    /// Of `asked`, the word z of a tile (bit 8 y + x), those that the ball may meet: all that it does, and
    /// some that it just misses.
    std::uint64_t voxels_near_ball(const BallInTile& ball, int z, std::uint64_t asked))

}  // namespace pade::mapping
