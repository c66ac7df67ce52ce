#include "pade/mapping/pending_hits.hpp"

#include <algorithm>
#include <utility>

namespace pade::mapping {

/// Where the tile is, or the empty slot where it would be.
std::size_t PendingHits::slot_of(std::uint64_t tile) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = ((tile >> 9U) * 0x9e3779b97f4a7c15U >> 20U) & mask;
  while (slots_[slot] != 0 && tiles_[slots_[slot] - 1]->code != tile) slot = (slot + 1) & mask;
  return slot;
}

PendingHits::Tile* PendingHits::find(std::uint64_t tile) const {
  if (last_ != nullptr && last_->code == tile) return last_;
  if (used_ == 0) return nullptr;
  const std::uint32_t found = slots_[slot_of(tile)];
  return found == 0 ? nullptr : tiles_[found - 1].get();
}

PendingHits::Tile& PendingHits::opened(std::uint64_t tile) {
  constexpr std::size_t kSmallest = 1U << 10U;
  if (Tile* found = find(tile); found != nullptr) return *found;
  if (2 * used_ >= slots_.size()) index_tiles(std::max(kSmallest, 2 * slots_.size()));
  if (used_ == tiles_.size()) tiles_.push_back(std::make_unique<Tile>());
  Tile& fresh = *tiles_[used_];
  fresh.code = tile;
  slots_[slot_of(tile)] = static_cast<std::uint32_t>(++used_);
  return fresh;
}

/// Drops the forgotten ones where that spares memory, before one more is taken in.
void PendingHits::make_room(Tile& tile) const {
  if (tile.waiting.size() < tile.waiting.capacity()) return;
  for (const Waiting& waiting : tile.waiting)
    if (is_forgotten(waiting)) tile.places[waiting.voxel] = 0;
  std::erase_if(tile.waiting, [this](const Waiting& waiting) { return is_forgotten(waiting); });
  for (std::size_t i = 0; i < tile.waiting.size(); ++i)
    tile.places[tile.waiting[i].voxel] = static_cast<std::uint16_t>(i + 1);
}

std::size_t& PendingHits::seen_last_in(int view) {
  const auto i = static_cast<std::size_t>(view - oldest_view_);
  if (i >= seen_last_.size()) seen_last_.resize(i + 1);
  return seen_last_[i];
}

/// What waits in a voxel, or a new one that no look has counted for yet.
PendingHits::Waiting& PendingHits::opened(Tile& tile, std::size_t voxel, int view) {
  const std::uint16_t place = tile.places[voxel];
  if (place != 0 && !is_forgotten(tile.waiting[place - 1U])) return tile.waiting[place - 1U];
  ++size_;
  ++seen_last_in(view);
  const Waiting fresh{{0, 0, 0, view, view}, static_cast<std::uint16_t>(voxel)};
  if (place != 0) return tile.waiting[place - 1U] = fresh;
  make_room(tile);
  tile.waiting.push_back(fresh);
  tile.places[voxel] = static_cast<std::uint16_t>(tile.waiting.size());
  return tile.waiting.back();
}

const PendingHits::Evidence& PendingHits::add(std::uint64_t code, float weight, float points, int view) {
  Tile& tile = opened(code >> 9U << 9U);
  last_ = &tile;
  tile.last_view = view;
  Evidence& evidence = opened(tile, code & 511U, view).evidence;
  if (evidence.hits > 0 && evidence.last_view == view) return evidence;
  --seen_last_in(evidence.last_view);
  ++seen_last_in(view);
  evidence.weight += weight;
  evidence.points += points;
  ++evidence.hits;
  evidence.last_view = view;
  return evidence;
}

float PendingHits::weight(std::uint64_t code) const {
  const Tile* tile = find(code >> 9U << 9U);
  const std::size_t place = tile == nullptr ? 0U : tile->places[code & 511U];
  if (place == 0 || is_forgotten(tile->waiting[place - 1])) return 0;
  return tile->waiting[place - 1].evidence.weight;
}

void PendingHits::erase(std::uint64_t code) {
  Tile* tile = find(code >> 9U << 9U);
  if (tile == nullptr || tile->places[code & 511U] == 0) return;
  Waiting& gone = tile->waiting[tile->places[code & 511U] - 1U];
  if (!is_forgotten(gone)) {
    --seen_last_in(gone.evidence.last_view);
    --size_;
  }
  tile->places[tile->waiting.back().voxel] = tile->places[code & 511U];
  gone = tile->waiting.back();
  tile->places[code & 511U] = 0;
  tile->waiting.pop_back();
}

void PendingHits::forget_before(int view) {
  if (view <= oldest_view_) return;
  const std::size_t passed = std::min(static_cast<std::size_t>(view - oldest_view_), seen_last_.size());
  const auto end = seen_last_.begin() + static_cast<std::ptrdiff_t>(passed);
  for (auto count = seen_last_.begin(); count != end; ++count) size_ -= *count;
  seen_last_.erase(seen_last_.begin(), end);
  oldest_view_ = view;
  for (std::size_t i = 0; i < used_;) {
    Tile& tile = *tiles_[i];
    if (tile.last_view >= view) {
      ++i;
      continue;
    }
    tile.places.fill(0);
    tile.waiting.clear();
    std::swap(tiles_[i], tiles_[--used_]);
  }
  last_ = nullptr;
  index_tiles(slots_.size());
}

void PendingHits::index_tiles(std::size_t slots) {
  slots_.assign(slots, 0);
  for (std::size_t i = 0; i < used_; ++i)
    slots_[slot_of(tiles_[i]->code)] = static_cast<std::uint32_t>(i + 1);
}

}  // namespace pade::mapping
