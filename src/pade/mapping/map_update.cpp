#include "pade/mapping/map_update.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace pade::mapping {
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

unsigned bits_below(unsigned depth) { return 3 * (kTreeDepth - depth); }

/// Walks the octree from the top, all in the camera's frame.
struct FreeSpaceSearch {
  const Clearance& clearance;
  std::vector<CellUpdate>& out;
  std::array<Eigen::Vector3d, 8> to_child;  // from the centre of a cube of side 1 to those of its eighths

  void visit(std::uint64_t code, const Eigen::Vector3d& centre, double side, unsigned depth) const {
    const View view = clearance.look_at(centre, side, depth == kTreeDepth);
    if (view == View::nothing) return;
    if (view == View::free) {
      out.push_back({code, depth, false});
      return;
    }
    if (depth == kTreeDepth) return;  // a voxel has no parts
    for (std::uint64_t i = 0; i < 8; ++i) {
      visit(code | i << bits_below(depth + 1), centre + side * to_child[i], 0.5 * side, depth + 1);
    }
  }
};

}  // namespace

std::uint64_t morton_code(const octomap::OcTreeKey& key) {
  return spread(key[0]) | spread(key[1]) << 1U | spread(key[2]) << 2U;
}

octomap::OcTreeKey morton_key(std::uint64_t code) {
  return {gather(code), gather(code >> 1U), gather(code >> 2U)};
}

MapCell cell_of(std::uint64_t code, unsigned depth, double voxel) {
  MapCell cell;
  cell.key = morton_key(code);
  cell.depth = depth;
  const double voxels = static_cast<double>(1U << (kTreeDepth - depth));
  for (unsigned axis = 0; axis < 3; ++axis) {
    cell.centre[static_cast<int>(axis)] =
        static_cast<float>((static_cast<double>(cell.key[axis]) - kTreeCentre + 0.5 * voxels) * voxel);
  }
  cell.side = static_cast<float>(voxels * voxel);
  return cell;
}

void HitCounter::add(const octomap::OcTreeKey& key) {
  if (last_ < hits_.size() && hits_[last_].key == key) {
    ++hits_[last_].count;
    return;
  }
  if (2 * hits_.size() >= slots_.size()) grow();
  const std::size_t slot = slot_of(key);
  if (slots_[slot] == 0) {
    hits_.push_back({key, 0});
    slots_[slot] = static_cast<std::uint32_t>(hits_.size());
  }
  last_ = slots_[slot] - 1;
  ++hits_[last_].count;
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
    add(hit.key);
    hits_.back().count = hit.count;
  }
}

void find_free_cells(const Clearance& clearance, double voxel, std::vector<CellUpdate>& out) {
  FreeSpaceSearch search{clearance, out, {}};
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1U) != 0 ? 1 : -1, (i & 2U) != 0 ? 1 : -1, (i & 4U) != 0 ? 1 : -1);
    search.to_child[i] = 0.25 * clearance.R_camera_world() * corner;
  }
  search.visit(0, clearance.in_camera(Eigen::Vector3d::Zero()), 2.0 * kTreeCentre * voxel, 0);
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
    apply_to_all(node, created, depth, updates.front(), change);
    return;
  }
  if (!created && !nodeHasChildren(node)) {
    // A cube of one state. Where it is sure already of what all updates say, there is nothing to do below it.
    const float value = node->getLogOdds();
    const auto says = [](bool hit) { return [hit](const CellUpdate& update) { return update.hit == hit; }; };
    if (value <= clamping_thres_min && std::all_of(updates.begin(), updates.end(), says(false))) return;
    if (value >= clamping_thres_max && std::all_of(updates.begin(), updates.end(), says(true))) return;
    expandNode(node);
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
                            update.hit};
      apply_to_all(getNodeChild(node, i), is_new, depth + 1, part, change);
    }
    settle(node);
    return;
  }
  const bool was_occupied = !created && isNodeOccupied(node);
  updateNodeLogOdds(node, update.hit ? prob_hit_log : prob_miss_log);
  const bool is_occupied = isNodeOccupied(node);
  if (!created && was_occupied == is_occupied) return;
  (is_occupied ? change.became_occupied : change.became_free)
      .push_back(cell_of(update.code, depth, resolution));
}

void UpdatableTree::settle(octomap::OcTreeNode* node) {
  if (!pruneNode(node)) node->updateOccupancyChildren();
}

}  // namespace pade::mapping
