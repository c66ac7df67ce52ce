#include "pade/mapping/pending_hits.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace pade::mapping {

/// Voxels of one cube of 2 x 2 x 2 lie together.
std::size_t PendingHits::home_of(std::uint64_t code) const {
  const std::uint64_t cube = (code >> 3U) * 0x9e3779b97f4a7c15U >> 20U;
  return (cube << 3U | (code & 7U)) & (slots_.size() - 1);
}

/// Where it is, or the empty slot where it would be.
std::size_t PendingHits::slot_of(std::uint64_t code) const {
  std::size_t slot = home_of(code);
  while (slots_[slot].code != kEmpty && slots_[slot].code != code) slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

const PendingHits::Evidence& PendingHits::add(std::uint64_t code, float weight, float points, int view) {
  constexpr std::size_t kSmallest = 1U << 10U;
  if (is_crowded()) rehash(std::max(kSmallest, 2 * slots_.size()), std::numeric_limits<int>::min());
  Slot& slot = slots_[slot_of(code)];
  Evidence& evidence = slot.evidence;
  const bool is_new = slot.code == kEmpty;
  if (is_new || evidence.last_view != view) {
    if (is_new) {
      slot.code = code;
      evidence = {};
      evidence.first_view = view;
      ++size_;
    }
    evidence.weight += weight;
    evidence.points += points;
    ++evidence.hits;
    evidence.last_view = view;
  }
  return evidence;
}

float PendingHits::weight(std::uint64_t code) const {
  if (slots_.empty()) return 0;
  const Slot& slot = slots_[slot_of(code)];
  return slot.code == kEmpty ? 0 : slot.evidence.weight;
}

void PendingHits::erase(std::uint64_t code) {
  if (slots_.empty()) return;
  const std::size_t mask = slots_.size() - 1;
  std::size_t hole = slot_of(code);
  if (slots_[hole].code == kEmpty) return;
  // What was pushed on by it moves up, so that no search ends too early.
  for (std::size_t slot = (hole + 1) & mask; slots_[slot].code != kEmpty; slot = (slot + 1) & mask) {
    if (((slot - home_of(slots_[slot].code)) & mask) < ((slot - hole) & mask)) continue;
    slots_[hole] = slots_[slot];
    hole = slot;
  }
  slots_[hole].code = kEmpty;
  --size_;
}

void PendingHits::forget_before(int view) { rehash(slots_.size(), view); }

void PendingHits::rehash(std::size_t slots, int oldest_view) {
  spare_.assign(slots, {});
  spare_.swap(slots_);
  size_ = 0;
  for (const Slot& slot : spare_) {
    if (slot.code == kEmpty || slot.evidence.last_view < oldest_view) continue;
    slots_[slot_of(slot.code)] = slot;
    ++size_;
  }
}

}  // namespace pade::mapping
