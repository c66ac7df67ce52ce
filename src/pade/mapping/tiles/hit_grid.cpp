#include "pade/mapping/tiles/hit_grid.hpp"

#include <algorithm>
#include <bit>

namespace pade::mapping {

void HitGrid::add(const VoxelKey& key, std::uint32_t points, std::uint32_t certainty) {
  const std::uint64_t tile = morton_code(key) >> 9U << 9U;
  if (last_ == nullptr || last_->code != tile) last_ = &opened(tile);
  const std::size_t index = index_in_tile(key[0], key[1], key[2]);
  Count& count = last_->counts[index];
  count.points += points;
  count.certainty += certainty;
  last_->hit[index / 64] |= std::uint64_t{1} << index % 64;
}

/// Where the tile is, or the empty slot where it would be.
std::size_t HitGrid::slot_of(std::uint64_t tile) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = (tile * 0x9e3779b97f4a7c15U >> 20U) & mask;
  while (slots_[slot] != 0 && tiles_[slots_[slot] - 1]->code != tile) slot = (slot + 1) & mask;
  return slot;
}

const HitGrid::Tile* HitGrid::find(std::uint64_t tile) const {
  const std::uint32_t found = slots_[slot_of(tile)];
  return found == 0 ? nullptr : tiles_[found - 1].get();
}

HitGrid::Tile& HitGrid::opened(std::uint64_t tile) {
  if (2 * used_ >= slots_.size()) grow();
  const std::size_t slot = slot_of(tile);
  if (slots_[slot] == 0) {
    if (used_ == tiles_.size()) tiles_.push_back(std::make_unique<Tile>());
    tiles_[used_]->code = tile;
    slots_[slot] = static_cast<std::uint32_t>(++used_);
  }
  return *tiles_[slots_[slot] - 1];
}

void HitGrid::grow() {
  constexpr std::size_t kSmallest = 1U << 12U;
  slots_.assign(std::max(kSmallest, 4 * slots_.size()), 0U);
  for (std::size_t i = 0; i < used_; ++i)
    slots_[slot_of(tiles_[i]->code)] = static_cast<std::uint32_t>(i + 1);
}

void HitGrid::clear() {
  for (std::size_t i = 0; i < used_; ++i) {
    Tile& tile = *tiles_[i];
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      for (; tile.hit[eighth] != 0; tile.hit[eighth] &= tile.hit[eighth] - 1)
        tile.counts[64 * eighth + static_cast<std::size_t>(std::countr_zero(tile.hit[eighth]))] = {};
    }
  }
  std::fill(slots_.begin(), slots_.end(), 0U);
  used_ = 0;
  last_ = nullptr;
}

std::vector<const HitGrid::Tile*> HitGrid::tiles() const {
  std::vector<const Tile*> all;
  all.reserve(used_);
  for (std::size_t i = 0; i < used_; ++i) all.push_back(tiles_[i].get());
  std::sort(all.begin(), all.end(), [](const Tile* a, const Tile* b) { return a->code < b->code; });
  return all;
}

HitGrid::Around HitGrid::around(const Tile& tile) const {
  constexpr int kSide = 8;
  const VoxelKey key = morton_key(tile.code);
  Around all{};
  for (int i = 0; i < 27; ++i) {
    const VoxelKey beside{static_cast<std::uint16_t>(key[0] + kSide * (i % 3 - 1)),
                          static_cast<std::uint16_t>(key[1] + kSide * (i / 3 % 3 - 1)),
                          static_cast<std::uint16_t>(key[2] + kSide * (i / 9 - 1))};
    all[static_cast<std::size_t>(i)] = i == 13 ? &tile : find(morton_code(beside));
  }
  return all;
}

}  // namespace pade::mapping
