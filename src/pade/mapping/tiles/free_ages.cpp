#include "pade/mapping/tiles/free_ages.hpp"

#include <algorithm>
#include <vector>

namespace pade::mapping {

void FreeAges::see(std::span<const FreeCube> free) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  Seen& seen = seen_[now_];
  for (const FreeCube& cube : free) {
    if (cube.depth == kTileDepth) {
      Words& words = seen[cube.code];
      for (std::size_t i = 0; i < words.size(); ++i) words[i] |= cube.voxels[i];
      continue;
    }
    for (std::uint64_t code = cube.code; code < cube.code + voxels_of(cube.depth);
         code += voxels_of(kTileDepth))
      seen[code].fill(kAll);
  }
}

void FreeAges::end_period(VoxelStore& store, MapChange& change) {
  now_ = (now_ + 1) % kPeriods;
  std::vector<std::uint64_t> tiles;
  for (const auto& [code, words] : seen_[now_]) tiles.push_back(code);
  std::sort(tiles.begin(), tiles.end());  // the same order each time
  for (const std::uint64_t code : tiles) {
    Words old = seen_[now_].at(code);
    for (std::size_t i = 0; i < kPeriods; ++i) {
      if (i == now_) continue;
      const auto again = seen_[i].find(code);
      if (again == seen_[i].end()) continue;
      for (std::size_t word = 0; word < old.size(); ++word) old[word] &= ~again->second[word];
    }
    store.forget_free(code, old, change);
  }
  seen_[now_].clear();
}

void FreeAges::forget(Time now, VoxelStore& store, MapChange& change) {
  if (!begun_) {
    begun_ = true;
    start_ = now;
    return;
  }
  // After a gap all periods are over, and no more than that need to end.
  for (std::size_t ended = 0; seconds_between(start_, now) >= period_; ++ended) {
    if (ended == kPeriods) {
      start_ = now;
      return;
    }
    end_period(store, change);
    start_.nanoseconds += Time::from_seconds(period_).nanoseconds;
  }
}

}  // namespace pade::mapping
