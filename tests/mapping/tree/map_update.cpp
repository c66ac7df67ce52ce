#include "mapping/tree/map_update.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace pade::mapping::tree {
namespace {

/// Spreads 16 bits to every third bit.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 16U) & 0x0000ff0000ffU;
  x = (x | x << 8U) & 0x00f00f00f00fU;
  x = (x | x << 4U) & 0x0c30c30c30c3U;
  x = (x | x << 2U) & 0x249249249249U;
  return x;
}

std::uint16_t gather(std::uint64_t x) {
  x &= 0x249249249249U;
  x = (x | x >> 2U) & 0x0c30c30c30c3U;
  x = (x | x >> 4U) & 0x00f00f00f00fU;
  x = (x | x >> 8U) & 0x0000ff0000ffU;
  x = (x | x >> 16U) & 0x00000000ffffU;
  return static_cast<std::uint16_t>(x);
}

/// Walks the octree from the top, all in the camera's frame.
class FreeSpaceSearch {
 public:
  FreeSpaceSearch(const Clearance& now, std::span<const Clearance* const> earlier, bool alone, float change,
                  std::vector<CellUpdate>& out)
      : now_(now), alone_(alone), change_(change), out_(out) {
    for (std::size_t i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1);
      to_child_[i] = 0.25 * now.R_camera_world() * corner;
    }
    for (const Clearance* clearance : earlier) {
      witnesses_.push_back({clearance, clearance->R_camera_world() * now.R_camera_world().transpose(),
                            clearance->in_camera(now.origin())});
    }
  }

  std::size_t search(double side) {
    const auto all = static_cast<std::uint32_t>((std::uint64_t{1} << witnesses_.size()) - 1);
    visit({0, now_.in_camera(Eigen::Vector3d::Zero()), side, 0}, View::partly, all);
    return pending_;
  }

 private:
  struct Witness {
    const Clearance* clearance;
    Eigen::Matrix3d R_witness_now;
    Eigen::Vector3d t_witness_now;
  };
  struct Cube {
    std::uint64_t code;
    Eigen::Vector3d centre;  // in the camera's frame
    double side;
    unsigned depth;
  };

  /// What the witnesses in `open` say: free where one of them does. Those that know nothing leave `open`.
  View ask(const Cube& cube, std::uint32_t& open) const {
    for (std::size_t i = 0; i < witnesses_.size(); ++i) {
      const std::uint32_t bit = std::uint32_t{1} << i;
      if ((open & bit) == 0) continue;
      const Witness& witness = witnesses_[i];
      const View view = witness.clearance->look_at(
          witness.R_witness_now * cube.centre + witness.t_witness_now, cube.side, cube.depth == kTreeDepth);
      if (view == View::free) return View::free;
      if (view == View::nothing) open &= ~bit;
    }
    return open == 0 ? View::nothing : View::partly;
  }

  /// @param seen  what is known already of the cube that this one is a part of
  void visit(const Cube& cube, View seen, std::uint32_t open) {
    if (seen != View::free) seen = now_.look_at(cube.centre, cube.side, cube.depth == kTreeDepth);
    if (seen == View::nothing) return;
    if (seen == View::free) {
      const View confirmed = alone_ ? View::free : ask(cube, open);
      if (confirmed == View::free) out_.push_back({cube.code, cube.depth, change_});
      if (confirmed == View::nothing) pending_ += voxels_of(cube.depth);
      if (confirmed != View::partly) return;
    }
    if (cube.depth == kTreeDepth) return;  // a voxel has no parts
    for (std::uint64_t i = 0; i < 8; ++i) {
      visit({cube.code | i << bits_below(cube.depth + 1), cube.centre + cube.side * to_child_[i],
             0.5 * cube.side, cube.depth + 1},
            seen, open);
    }
  }

  const Clearance& now_;
  bool alone_;
  float change_;
  std::vector<CellUpdate>& out_;
  std::array<Eigen::Vector3d, 8> to_child_;  // from the centre of a cube of side 1 to those of its eighths
  std::vector<Witness> witnesses_;
  std::size_t pending_ = 0;
};

/// `hits` are those within `cell`.
void cut_out_of(const CellUpdate& cell, std::span<const CellUpdate> hits, std::vector<CellUpdate>& out) {
  if (hits.empty()) {
    out.push_back(cell);
    return;
  }
  if (cell.depth == kTreeDepth) return;
  const unsigned below = bits_below(cell.depth + 1);
  for (std::uint64_t i = 0; i < 8; ++i) {
    const CellUpdate part{cell.code | i << below, cell.depth + 1, cell.change};
    const auto end = std::find_if(hits.begin(), hits.end(), [&](const CellUpdate& hit) {
      return hit.code >> below != part.code >> below;
    });
    const auto count = static_cast<std::size_t>(end - hits.begin());
    cut_out_of(part, hits.first(count), out);
    hits = hits.subspan(count);
  }
}

}  // namespace

std::uint64_t morton_code(const octomap::OcTreeKey& key) {
  return spread(key[0]) | spread(key[1]) << 1U | spread(key[2]) << 2U;
}

octomap::OcTreeKey morton_key(std::uint64_t code) {
  return {gather(code), gather(code >> 1U), gather(code >> 2U)};
}

void HitCounter::add(const octomap::OcTreeKey& key, std::uint32_t certainty) {
  if (last_ < hits_.size() && hits_[last_].key == key) {
    ++hits_[last_].count;
    hits_[last_].certainty += certainty;
    return;
  }
  if (2 * hits_.size() >= slots_.size()) grow();
  const std::size_t slot = slot_of(key);
  if (slots_[slot] == 0) {
    hits_.push_back({key, 0, 0});
    slots_[slot] = static_cast<std::uint32_t>(hits_.size());
  }
  last_ = slots_[slot] - 1;
  ++hits_[last_].count;
  hits_[last_].certainty += certainty;
}

/// Where the voxel is, or the empty slot where it would be.
std::size_t HitCounter::slot_of(const octomap::OcTreeKey& key) const {
  const std::uint64_t packed =
      key[0] | static_cast<std::uint64_t>(key[1]) << 16U | static_cast<std::uint64_t>(key[2]) << 32U;
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = (packed * 0x9e3779b97f4a7c15U >> 20U) & mask;
  while (slots_[slot] != 0 && !(hits_[slots_[slot] - 1].key == key)) slot = (slot + 1) & mask;
  return slot;
}

std::uint32_t HitCounter::count(const octomap::OcTreeKey& key) const {
  if (slots_.empty()) return 0;
  const std::uint32_t found = slots_[slot_of(key)];
  return found == 0 ? 0 : hits_[found - 1].count;
}

void HitCounter::clear() {
  hits_.clear();
  std::fill(slots_.begin(), slots_.end(), 0U);
  last_ = 0;
}

void HitCounter::grow() {
  constexpr std::size_t kSmallest = 1U << 14U;
  const std::vector<Hit> old = std::move(hits_);
  slots_.assign(std::max(kSmallest, 4 * slots_.size()), 0U);
  hits_.clear();
  for (const Hit& hit : old) {
    last_ = hits_.size();
    add(hit.key, hit.certainty);
    hits_.back().count = hit.count;
  }
}

std::size_t find_free_cells(const Clearance& now, std::span<const Clearance* const> earlier, bool alone,
                            double voxel, float change, std::vector<CellUpdate>& out) {
  return FreeSpaceSearch(now, earlier, alone, change, out).search(2.0 * kTreeCentre * voxel);
}

void cut_out(std::span<const CellUpdate> cells, std::span<const CellUpdate> hits,
             std::vector<CellUpdate>& out) {
  auto hit = hits.begin();
  for (const CellUpdate& cell : cells) {
    while (hit != hits.end() && hit->code < cell.code) ++hit;
    const auto first = hit;
    while (hit != hits.end() && hit->code - cell.code < voxels_of(cell.depth)) ++hit;
    cut_out_of(cell, {first, hit}, out);
  }
}

void UpdatableTree::apply(std::span<const CellUpdate> updates, MapChange& change) {
  if (updates.empty()) return;
  bool created = false;
  if (root == nullptr) {
    root = new octomap::OcTreeNode();
    ++tree_size;
    created = true;
  }
  apply_below(root, created, 0, updates, change);
  size_changed = true;
}

void UpdatableTree::apply_below(octomap::OcTreeNode* node, bool created, unsigned depth,
                                std::span<const CellUpdate> updates, MapChange& change) {
  if (updates.front().depth == depth) {
    if (depth <= kTileDepth) change.touched.push_back(cell_of(updates.front().code, depth, resolution));
    apply_to_all(node, created, depth, updates.front(), change);
    return;
  }
  if (!created && !nodeHasChildren(node)) {
    // A cube of one state. Where it is sure already of what all updates say, there is nothing to do below it.
    const float value = node->getLogOdds();
    const auto says = [](bool hit) {
      return [hit](const CellUpdate& update) { return (update.change > 0) == hit; };
    };
    if (value <= clamping_thres_min && std::all_of(updates.begin(), updates.end(), says(false))) return;
    if (value >= clamping_thres_max && std::all_of(updates.begin(), updates.end(), says(true))) return;
    expandNode(node);
  }
  if (depth == kTileDepth) {
    const unsigned below = bits_below(depth);
    change.touched.push_back(cell_of(updates.front().code >> below << below, depth, resolution));
  }
  const unsigned shift = bits_below(depth + 1);
  while (!updates.empty()) {
    const std::uint64_t index = updates.front().code >> shift & 7U;
    const auto end = std::find_if(updates.begin(), updates.end(), [&](const CellUpdate& update) {
      return (update.code >> shift & 7U) != index;
    });
    const auto count = static_cast<std::size_t>(end - updates.begin());
    const auto child = static_cast<unsigned>(index);
    const bool is_new = !nodeChildExists(node, child);
    if (is_new) createNodeChild(node, child);
    apply_below(getNodeChild(node, child), is_new, depth + 1, updates.first(count), change);
    updates = updates.subspan(count);
  }
  settle(node);
}

void UpdatableTree::apply_to_all(octomap::OcTreeNode* node, bool created, unsigned depth,
                                 const CellUpdate& update, MapChange& change) {
  if (nodeHasChildren(node)) {
    for (unsigned i = 0; i < 8; ++i) {
      const bool is_new = !nodeChildExists(node, i);
      if (is_new) createNodeChild(node, i);
      const CellUpdate part{update.code | static_cast<std::uint64_t>(i) << bits_below(depth + 1), depth + 1,
                            update.change};
      apply_to_all(getNodeChild(node, i), is_new, depth + 1, part, change);
    }
    settle(node);
    return;
  }
  const bool was_occupied = !created && isNodeOccupied(node);
  updateNodeLogOdds(node, update.change);
  const bool is_occupied = isNodeOccupied(node);
  if (!created && was_occupied == is_occupied) return;
  (is_occupied ? change.became_occupied : change.became_free)
      .push_back(cell_of(update.code, depth, resolution));
}

void UpdatableTree::settle(octomap::OcTreeNode* node) {
  if (!pruneNode(node)) node->updateOccupancyChildren();
}

}  // namespace pade::mapping::tree
