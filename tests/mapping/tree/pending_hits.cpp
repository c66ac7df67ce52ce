#include "mapping/tree/pending_hits.hpp"

namespace pade::mapping::tree {

const PendingHits::Evidence& PendingHits::add(std::uint64_t code, float weight, float points, int view) {
  const auto [entry, is_new] = voxels_.try_emplace(code);
  Evidence& evidence = entry->second;
  if (is_new || evidence.last_view != view) {
    evidence.weight += weight;
    evidence.points += points;
    ++evidence.hits;
    evidence.last_view = view;
    if (is_new) evidence.first_view = view;
  }
  return evidence;
}

float PendingHits::weight(std::uint64_t code) const {
  const auto entry = voxels_.find(code);
  return entry == voxels_.end() ? 0 : entry->second.weight;
}

void PendingHits::forget_before(int view) {
  std::erase_if(voxels_, [view](const auto& entry) { return entry.second.last_view < view; });
}

}  // namespace pade::mapping::tree
