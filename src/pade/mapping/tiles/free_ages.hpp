// How long ago voxels were seen free, in quarters of the time after which they are forgotten.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>

#include "pade/core/time.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

namespace pade::mapping {

/// Which voxels were seen free in each of the last periods.
class FreeAges {
 public:
  /// @param seconds  after which free voxels are forgotten, > 0
  explicit FreeAges(double seconds) : period_(seconds / (kPeriods - 1)) {}

  /// Time goes on: what was last seen free before the kept periods becomes unknown, unless it is occupied by
  /// now. Nothing older than the last call's time happens again.
  void forget(Time now, VoxelStore& store, MapChange& change);
  /// These voxels are free at the time of the last call of forget(). Cubes larger than a tile count as their
  /// tiles.
  void see(std::span<const FreeCube> free);

 private:
  static constexpr std::size_t kPeriods = 5;  // the one that goes on, and four whole ones
  using Words = std::array<std::uint64_t, 8>;
  using Seen = std::unordered_map<std::uint64_t, Words>;  // by the Morton code of the tile
  void end_period(VoxelStore& store, MapChange& change);

  double period_;  // s
  bool begun_ = false;
  Time start_;  // of the period that goes on
  std::array<Seen, kPeriods> seen_;
  std::size_t now_ = 0;  // of `seen_`
};

}  // namespace pade::mapping
