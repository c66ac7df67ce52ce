#include "pade/mapping/tiles/hit_grid.hpp"

#include <algorithm>
#include <bit>

namespace pade::mapping {

namespace {

/// Of the tile that holds a voxel, from the packed key of the voxel.
constexpr std::uint64_t kCorner = ~std::uint64_t{0x000700070007};

std::uint64_t packed(const VoxelKey& key) {
  return key[0] | static_cast<std::uint64_t>(key[1]) << 16U | static_cast<std::uint64_t>(key[2]) << 32U;
}

}  // namespace

void HitGrid::add(std::uint64_t key, std::uint32_t points, std::uint32_t certainty) {
  const std::uint64_t corner = key & kCorner;
  if (last_ == nullptr || corner != last_corner_) {
    last_ = &opened(corner);
    last_corner_ = corner;
  }
  const std::size_t index = index_in_tile(static_cast<int>(key & 7U), static_cast<int>(key >> 16U & 7U),
                                          static_cast<int>(key >> 32U & 7U));
  Count& count = last_->counts[index];
  count.points += points;
  count.certainty += certainty;
  last_->hit[index / 64] |= std::uint64_t{1} << index % 64;
}

/// Where the tile is, or the empty slot where it would be.
std::size_t HitGrid::slot_of(std::uint64_t corner) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = ((corner >> 3U) * 0x9e3779b97f4a7c15U >> 40U) & mask;
  while (slots_[slot].tile != nullptr && slots_[slot].corner != corner) slot = (slot + 1) & mask;
  return slot;
}

const HitGrid::Tile* HitGrid::find(std::uint64_t corner) const { return slots_[slot_of(corner)].tile; }

HitGrid::Tile& HitGrid::opened(std::uint64_t corner) {
  if (2 * used_ >= slots_.size()) grow();
  Slot& slot = slots_[slot_of(corner)];
  if (slot.tile != nullptr) return *slot.tile;
  if (used_ == tiles_.size()) tiles_.push_back(std::make_unique<Tile>());
  Tile& fresh = *tiles_[used_++];
  fresh.key = {static_cast<std::uint16_t>(corner), static_cast<std::uint16_t>(corner >> 16U),
               static_cast<std::uint16_t>(corner >> 32U)};
  fresh.code = morton_code(fresh.key);
  slot = {corner, &fresh};
  return fresh;
}

void HitGrid::grow() {
  constexpr std::size_t kSmallest = 1U << 12U;
  slots_.assign(std::max(kSmallest, 4 * slots_.size()), Slot{});
  for (std::size_t i = 0; i < used_; ++i) {
    const std::uint64_t corner = packed(tiles_[i]->key);
    slots_[slot_of(corner)] = {corner, tiles_[i].get()};
  }
}

void HitGrid::clear() {
  for (std::size_t i = 0; i < used_; ++i) {
    Tile& tile = *tiles_[i];
    for (std::size_t eighth = 0; eighth < 8; ++eighth) {
      for (; tile.hit[eighth] != 0; tile.hit[eighth] &= tile.hit[eighth] - 1)
        tile.counts[64 * eighth + static_cast<std::size_t>(std::countr_zero(tile.hit[eighth]))] = {};
    }
  }
  std::fill(slots_.begin(), slots_.end(), Slot{});
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
  const VoxelKey& key = tile.key;
  Around all{};
  for (int i = 0; i < 27; ++i) {
    const VoxelKey beside{static_cast<std::uint16_t>(key[0] + kSide * (i % 3 - 1)),
                          static_cast<std::uint16_t>(key[1] + kSide * (i / 3 % 3 - 1)),
                          static_cast<std::uint16_t>(key[2] + kSide * (i / 9 - 1))};
    all[static_cast<std::size_t>(i)] = i == 13 ? &tile : find(packed(beside));
  }
  return all;
}

}  // namespace pade::mapping
