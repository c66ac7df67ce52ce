#include "pade/mapping/query/map_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <unordered_set>
#include <utility>
#include <vector>

#include "pade/mapping/query/tile_builder.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

AlignedBox3d everywhere() {
  const Vector3d far = Vector3d::Constant(std::numeric_limits<double>::infinity());
  return {-far, far};
}

double probability_of(const Tile& tile, std::size_t in_tile, double step) {
  return 1 / (1 + std::exp(-step * tile.log_odds[in_tile]));
}

/// Adds the voxel to what is counted.
void count(const TileTree& tiles, const VoxelIndex& v, Contents& contents, int& highest) {
  if (!is_addressed(v)) {
    ++contents.unknown;
    return;
  }
  const Tile& tile = tiles.tile(v[0] >> 3, v[1] >> 3, v[2] >> 3);
  const Occupancy state = tile.at(v[0] & 7, v[1] & 7, v[2] & 7);
  if (state == Occupancy::unknown) {
    ++contents.unknown;
    return;
  }
  ++(state == Occupancy::occupied ? contents.occupied : contents.free);
  highest = std::max<int>(highest, tile.log_odds[index_in_tile(v)]);
}

bool knows_anything(const Tile& tile) {
  return std::any_of(tile.words.begin(), tile.words.end(),
                     [](const Tile::Word& word) { return word.known != 0; });
}

bool is_uniform(const Tile& tile) {
  const std::uint64_t occupied = tile.any_occupied ? ~std::uint64_t{0} : 0;
  return !tile.any_unknown && tile.log_odds.is_same_all_over() &&
         std::all_of(tile.words.begin(), tile.words.end(),
                     [&](const Tile::Word& word) { return word.occupied == occupied; });
}

/// The leaves of a tree of tiles, in Morton order and as few as say the same.
class Leaves {
 public:
  Leaves(const TileTree& tiles, const std::function<void(const MapLeaf&)>& visitor)
      : tiles_(tiles), visitor_(visitor) {}

  void visit() { walk(*tiles_.world, 0, 0); }

 private:
  static constexpr std::size_t kVoxels = 512;

  /// The tile that all of it is, unknown or uniform; null if there is none.
  static const Tile* one_tile(const Tile& tile) {
    return is_uniform(tile) || !knows_anything(tile) ? &tile : nullptr;
  }
  template <class Node>
  static const Tile* one_tile(const Node& node) {
    const auto& first = node.children.front();
    for (const auto& child : node.children)
      if (child != first) return nullptr;
    return one_tile(*first);
  }

  /// @param code   Morton code of its first voxel
  /// @param depth  in the octree
  template <class Part>
  void walk(const Part& part, std::uint64_t code, unsigned depth) {
    if (const Tile* const tile = one_tile(part))
      return say(code, depth, tile->at(0, 0, 0), tile->log_odds[0]);
    if constexpr (std::is_same_v<Part, Tile>) {
      walk_tile(part, code);
    } else {
      const unsigned below = depth + Part::kBits;
      for (std::uint64_t i = 0; i < part.children.size(); ++i) {
        const VoxelKey at = morton_key(i);
        const std::size_t slot =
            at[0] | std::size_t{at[1]} << Part::kBits | std::size_t{at[2]} << (2 * Part::kBits);
        walk(*part.children[slot], code + (i << bits_below(below)), below);
      }
    }
  }
  void walk_tile(const Tile& tile, std::uint64_t code) {
    for (std::size_t i = 0; i < kVoxels; ++i) {
      const VoxelKey v = morton_key(i);
      states_[i] = tile.at(v[0], v[1], v[2]);
      values_[i] = tile.log_odds[i];
    }
    for (std::size_t eighth = 0; eighth < kVoxels; eighth += 64) {
      if (are_same(eighth, 64)) {
        say(code + eighth, kTileDepth + 1, states_[eighth], values_[eighth]);
        continue;
      }
      for (std::size_t i = eighth; i < eighth + 64; i += 8) {
        if (are_same(i, 8)) {
          say(code + i, kTileDepth + 2, states_[i], values_[i]);
          continue;
        }
        for (std::size_t k = i; k < i + 8; ++k) say(code + k, kTreeDepth, states_[k], values_[k]);
      }
    }
  }
  [[nodiscard]] bool are_same(std::size_t from, std::size_t count) const {
    for (std::size_t i = from + 1; i < from + count; ++i)
      if (states_[i] != states_[from] || values_[i] != values_[from]) return false;
    return true;
  }
  /// The steps of the log-odds are coarse, the state is not.
  void say(std::uint64_t code, unsigned depth, Occupancy state, std::int8_t value) const {
    if (state == Occupancy::unknown) return;
    auto log_odds = static_cast<float>(tiles_.step * value);
    const bool is_occupied = state == Occupancy::occupied;
    if (is_occupied) {
      log_odds = std::max(log_odds, tiles_.occupied);
    } else if (log_odds >= tiles_.occupied) {
      log_odds = std::nextafter(tiles_.occupied, -std::numeric_limits<float>::infinity());
    }
    visitor_({code, depth, log_odds, is_occupied});
  }

  const TileTree& tiles_;
  const std::function<void(const MapLeaf&)>& visitor_;
  std::array<Occupancy, kVoxels> states_{};
  std::array<std::int8_t, kVoxels> values_{};
};

/// Bytes of a tree, what its nodes share counted once.
class Footprint {
 public:
  template <class Part>
  void add(const Part& part) {
    constexpr std::size_t kCounters = 16;  // of a shared pointer
    if (!counted_.insert(&part).second) return;
    bytes_ += sizeof part + kCounters;
    if constexpr (std::is_same_v<Part, Tile>) {
      bytes_ += part.log_odds.memory();
    } else {
      const typename Part::Child* before = nullptr;  // most are unknown, and the same
      for (const auto& child : part.children)
        if (child.get() != std::exchange(before, child.get())) add(*child);
    }
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::unordered_set<const void*> counted_;
  std::size_t bytes_ = 0;
};

constexpr int kNothingKnown = -1000;

void set_probability(Contents& contents, int highest, double step) {
  contents.probability = highest == kNothingKnown ? std::numeric_limits<double>::quiet_NaN()
                                                  : 1 / (1 + std::exp(-step * highest));
}

}  // namespace

double Hit::time(std::span<const double> times) const {
  if (segment + 1 >= times.size()) return times.empty() ? 0 : times.back();
  return times[segment] + share * (times[segment + 1] - times[segment]);
}

MapView::MapView(TileTree tiles, const AlignedBox3d& window)
    : tiles_(std::make_unique<const TileTree>(std::move(tiles))), window_(window) {}

MapView::~MapView() = default;

std::shared_ptr<const MapView> MapView::of(const OccupancyMap& map) { return of(map, everywhere()); }

std::shared_ptr<const MapView> MapView::of(const OccupancyMap& map, const AlignedBox3d& window) {
  const std::array<TouchedCube, 1> all{};
  TileTree tiles = rebuilt(empty_tiles(map.voxels(), map.options().voxel), map.voxels(), all,
                           tiles_of(window, map.options().voxel));
  return std::shared_ptr<const MapView>(new MapView(std::move(tiles), window));
}

std::shared_ptr<const MapView> MapView::after(const OccupancyMap& map, const MapChange& change) const {
  std::vector<TouchedCube> touched;
  touched.reserve(change.touched.size());
  for (const MapCell& cell : change.touched) {
    touched.push_back({morton_code(cell.key), cell.depth});
  }
  TileTree tiles = rebuilt(*tiles_, map.voxels(), touched, tiles_of(window_, tiles_->voxel));
  return std::shared_ptr<const MapView>(new MapView(std::move(tiles), window_));
}

std::shared_ptr<const MapView> MapView::flown(std::span<const Vector3d> path, double radius) const {
  std::vector<std::pair<VoxelIndex, std::shared_ptr<const Tile>>> changed;
  for (const auto& [place, inside] : voxels_along(path, radius, tiles_->voxel)) {
    const Tile& old = tiles_->tile(place[0], place[1], place[2]);
    if (!old.any_unknown) continue;
    changed.emplace_back(place, with_free(old, inside));
  }
  return std::shared_ptr<const MapView>(new MapView(with_tiles(*tiles_, std::move(changed)), window_));
}

double MapView::voxel() const { return tiles_->voxel; }

std::size_t MapView::memory() const {
  Footprint footprint;
  footprint.add(*tiles_->world);
  return footprint.bytes() + sizeof(TileTree) + tiles_->groups.capacity() * sizeof(const TileGroup*) +
         tiles_->near_tiles.capacity() * sizeof(const Tile*);
}

AlignedBox3d MapView::bounds() const {
  AlignedBox3d box;
  const TileBounds& tiles = tiles_->bounds;
  if (tiles.first[0] > tiles.last[0]) return box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    box.min()[axis] = (tiles.first[i] * kTileSide - kTreeCentre) * tiles_->voxel;
    box.max()[axis] = ((tiles.last[i] + 1) * kTileSide - kTreeCentre) * tiles_->voxel;
  }
  return box;
}

Occupancy TileTree::far_at(const Vector3d& point) const {
  VoxelIndex v;
  return voxel_at(point, per_voxel, v) ? at(v) : Occupancy::unknown;
}

Occupancy MapView::at(const Vector3d& point) const { return tiles_->state_at(point); }

double MapView::probability(const Vector3d& point) const {
  VoxelIndex v;
  if (!voxel_at(point, tiles_->per_voxel, v) || tiles_->at(v) == Occupancy::unknown)
    return std::numeric_limits<double>::quiet_NaN();
  return probability_of(tiles_->tile(v[0] >> 3, v[1] >> 3, v[2] >> 3), index_in_tile(v), tiles_->step);
}

Contents MapView::in_box(const AlignedBox3d& box) const {
  Contents contents;
  int highest = kNothingKnown;
  if (is_box(box)) {
    VoxelIndex first = voxel_beside(box.min(), tiles_->voxel);
    VoxelIndex last = voxel_beside(box.max(), tiles_->voxel);
    std::size_t all = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      all *= static_cast<std::size_t>(last[axis] - first[axis] + 1);
      first[axis] = std::max(first[axis], kTileSide * tiles_->bounds.first[axis]);
      last[axis] = std::min(last[axis], kTileSide * tiles_->bounds.last[axis] + kTileSide - 1);
    }
    VoxelIndex v{};
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2])
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1])
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0]) count(*tiles_, v, contents, highest);
    contents.unknown = all - contents.occupied - contents.free;
  }
  set_probability(contents, highest, tiles_->step);
  return contents;
}

Contents MapView::in_ball(const Vector3d& centre, double radius) const {
  Contents contents;
  int highest = kNothingKnown;
  if (centre.allFinite() && is_radius(radius)) {
    const VoxelIndex first = voxel_beside(centre.array() - radius, tiles_->voxel);
    const VoxelIndex last = voxel_beside(centre.array() + radius, tiles_->voxel);
    VoxelIndex v{};
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2])
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1])
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0])
          if (box_of(v, tiles_->voxel).squaredExteriorDistance(centre) < radius * radius)
            count(*tiles_, v, contents, highest);
  }
  set_probability(contents, highest, tiles_->step);
  return contents;
}

void MapView::for_each_leaf(const std::function<void(const MapLeaf&)>& visitor) const {
  Leaves(*tiles_, visitor).visit();
}

}  // namespace pade::mapping
