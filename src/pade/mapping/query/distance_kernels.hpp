// Squared distances from all voxels of a box to the nearest one that blocks: compiled once per instruction
// set, same numbers on each.
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::mapping {

/// Voxels of a row that are kept and worked on together, at most: rows are padded to a multiple of it.
inline constexpr int kDistanceLanes = 32;
/// Voxels along each axis, at most.
inline constexpr int kMostDistanceRows = 2000;
/// The largest `most` that fits 16 bits in all sums.
inline constexpr std::int32_t kMostOf16Bits = 16000;

/// A box of voxels and where its distances go.
template <class Value>
struct DistanceBox {
  int nx, ny, nz;  ///< voxels
  int stride;      ///< values from row to row of `squared`, a multiple of kDistanceLanes from nx on
  const std::uint8_t* blocked;  ///< bits of the rows along x, row y + ny z; none set from nx on
  int row_bytes;                ///< of `blocked`, readable for kDistanceLanes bits more than the stride
  int first_bit;                ///< of each row: 0 to 7
  std::int32_t most;            ///< squared, voxels: what is as far or farther
  Value* squared;               ///< out: rows along x, row y + ny z
  Value* scratch;               ///< of distance_scratch() values
};

/// @param longest  voxels of the longest side
inline long distance_scratch(int longest, int stride) {
  return 3L * kDistanceLanes * (longest + 2) + 3L * (stride + 2L * kDistanceLanes);
}

PADE_DECLARE_KERNEL(
    /// `most` up to kMostOf16Bits.
    void near_distances(const DistanceBox<std::int16_t>& box);
    void far_distances(const DistanceBox<std::int32_t>& box))

}  // namespace pade::mapping
