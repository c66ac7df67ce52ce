#include "pade/mapping/query/tile_builder.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <type_traits>

#include <octomap/OcTree.h>

#include "pade/mapping/map_update.hpp"

namespace pade::mapping {

/// One of each kind that is the same all over: unknown, or known with one state and one log-odds.
struct UniformTiles {
  static constexpr int kUnknown = 512;
  template <class Part>
  using Family = std::array<std::shared_ptr<const Part>, kUnknown + 1>;
  Family<Tile> tiles;
  Family<TileGroup> groups;
  Family<TileRegion> regions;
  Family<TileBlock> blocks;
  Family<TileWorld> worlds;
  std::mutex mutex;  // of whoever makes a tree
};

void Tile::summarise() {
  any_occupied = std::any_of(words.begin(), words.end(), [](const Word& word) { return word.occupied != 0; });
  any_unknown = std::any_of(words.begin(), words.end(), [](const Word& word) { return ~word.known != 0; });
}

void TileTree::index() {
  constexpr std::size_t kMostGroups = 1U << 16U;
  constexpr int kTilesOfAGroup = 8;
  groups.clear();
  if (bounds.first[0] > bounds.last[0]) return;
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first_group[axis] = bounds.first[axis] / kTilesOfAGroup;
    group_counts[axis] = bounds.last[axis] / kTilesOfAGroup - first_group[axis] + 1;
    count *= static_cast<std::size_t>(group_counts[axis]);
  }
  if (count > kMostGroups) return;
  for (int z = 0; z < group_counts[2]; ++z)
    for (int y = 0; y < group_counts[1]; ++y)
      for (int x = 0; x < group_counts[0]; ++x)
        groups.push_back(&group_by_nodes(first_group[0] + x, first_group[1] + y, first_group[2] + z));
}

namespace {

int quantised(double log_odds, double step) {
  return static_cast<int>(std::lround(std::clamp(log_odds / step, -127.0, 127.0)));
}

std::shared_ptr<const Tile> make_uniform(int value) {
  auto tile = std::make_shared<Tile>();
  if (value != UniformTiles::kUnknown) {
    const std::uint64_t all = ~std::uint64_t{0};
    tile->words.fill({all, value >= 256 ? all : 0});
    tile->log_odds.fill(static_cast<std::int8_t>(value % 256 - 128));
  }
  tile->summarise();
  return tile;
}

template <class Part>
UniformTiles::Family<Part>& family(UniformTiles& uniform) {
  if constexpr (std::is_same_v<Part, Tile>) return uniform.tiles;
  if constexpr (std::is_same_v<Part, TileGroup>) return uniform.groups;
  if constexpr (std::is_same_v<Part, TileRegion>) return uniform.regions;
  if constexpr (std::is_same_v<Part, TileBlock>) return uniform.blocks;
  if constexpr (std::is_same_v<Part, TileWorld>) return uniform.worlds;
}

template <class Part>
const std::shared_ptr<const Part>& uniform_part(UniformTiles& uniform, int value) {
  std::shared_ptr<const Part>& part = family<Part>(uniform)[static_cast<std::size_t>(value)];
  if (part == nullptr) {
    if constexpr (std::is_same_v<Part, Tile>) {
      part = make_uniform(value);
    } else {
      auto made = std::make_shared<Part>();
      made->children.fill(uniform_part<typename Part::Child>(uniform, value));
      part = std::move(made);
    }
  }
  return part;
}

template <class Part>
constexpr unsigned depth_of() {
  if constexpr (std::is_same_v<Part, Tile>) {
    return kTileDepth;
  } else {
    return depth_of<typename Part::Child>() - Part::kBits;
  }
}

unsigned bits_below(unsigned depth) { return 3 * (kTreeDepth - depth); }

/// Walks octree and tiles together.
class Builder {
 public:
  Builder(TileTree& tiles, const octomap::OcTree& octree, const TileBounds& window)
      : tiles_(tiles), octree_(octree), window_(window) {}

  template <class Part>
  std::shared_ptr<const Part> build(const octomap::OcTreeNode* node, std::uint64_t code,
                                    const std::shared_ptr<const Part>& old,
                                    std::span<const TouchedCube> touched) {
    const TileBounds place = place_of(code, depth_of<Part>());
    if (!touches(place)) return uniform_part<Part>(*tiles_.uniform, UniformTiles::kUnknown);
    if (node == nullptr) return uniform_part<Part>(*tiles_.uniform, UniformTiles::kUnknown);
    if (!octree_.nodeHasChildren(node) && is_inside(place)) {
      extend(place);
      return uniform_part<Part>(*tiles_.uniform, value_of(*node));
    }
    if constexpr (std::is_same_v<Part, Tile>) {
      extend(place);
      return tile_of(*node);
    } else {
      return node_of<Part>(node, code, old, touched);
    }
  }

 private:
  static TileBounds place_of(std::uint64_t code, unsigned depth) {
    const octomap::OcTreeKey key = morton_key(code);
    const int side = kVoxelsPerAxis >> depth;
    TileBounds place;
    for (unsigned axis = 0; axis < 3; ++axis) {
      place.first[axis] = key[axis] / kTileSide;
      place.last[axis] = (key[axis] + side - 1) / kTileSide;
    }
    return place;
  }
  [[nodiscard]] bool touches(const TileBounds& place) const {
    bool yes = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      yes = yes && place.first[axis] <= window_.last[axis] && place.last[axis] >= window_.first[axis];
    }
    return yes;
  }
  [[nodiscard]] bool is_inside(const TileBounds& place) const {
    bool yes = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      yes = yes && place.first[axis] >= window_.first[axis] && place.last[axis] <= window_.last[axis];
    }
    return yes;
  }
  void extend(const TileBounds& place) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tiles_.bounds.first[axis] = std::min(tiles_.bounds.first[axis], place.first[axis]);
      tiles_.bounds.last[axis] = std::max(tiles_.bounds.last[axis], place.last[axis]);
    }
  }
  [[nodiscard]] int value_of(const octomap::OcTreeNode& node) const {
    const int steps = quantised(node.getLogOdds(), tiles_.step) + 128;
    return octree_.isNodeOccupied(node) ? steps + 256 : steps;
  }

  template <class Part>
  std::shared_ptr<const Part> node_of(const octomap::OcTreeNode* node, std::uint64_t code,
                                      const std::shared_ptr<const Part>& old,
                                      std::span<const TouchedCube> touched) {
    using Child = typename Part::Child;
    constexpr unsigned kDepth = depth_of<Part>();
    constexpr unsigned kChildDepth = depth_of<Child>();
    const unsigned below = bits_below(kChildDepth);
    const std::uint64_t end = code + (std::uint64_t{1} << bits_below(kDepth));
    auto made = std::make_shared<Part>(*old);
    while (!touched.empty()) {
      const TouchedCube& cube = touched.front();
      std::size_t count = 1;
      std::uint64_t from = std::max(cube.code, code) >> below;
      std::uint64_t to = from;
      if (cube.depth <= kChildDepth) {
        to = (std::min(cube.code + (std::uint64_t{1} << bits_below(cube.depth)), end) - 1) >> below;
      } else {
        while (count < touched.size() && touched[count].code >> below == from) ++count;
      }
      for (std::uint64_t child = from; child <= to; ++child) {
        const std::uint64_t child_code = child << below;
        auto& slot = made->children[slot_of<Part>(child_code)];
        slot = build<Child>(descend(node, kDepth, kChildDepth, child_code), child_code, slot,
                            touched.first(count));
      }
      touched = touched.subspan(count);
    }
    return made;
  }

  template <class Part>
  static std::size_t slot_of(std::uint64_t code) {
    const octomap::OcTreeKey key = morton_key(code);
    const unsigned shift = kTreeDepth - depth_of<typename Part::Child>();
    const unsigned mask = (1U << Part::kBits) - 1;
    return (key[0] >> shift & mask) | (key[1] >> shift & mask) << Part::kBits |
           (key[2] >> shift & mask) << (2 * Part::kBits);
  }

  /// The node at a depth, or the leaf above it, or null where nothing is known.
  [[nodiscard]] const octomap::OcTreeNode* descend(const octomap::OcTreeNode* node, unsigned depth,
                                                   unsigned to, std::uint64_t code) const {
    for (unsigned d = depth + 1; d <= to && node != nullptr && octree_.nodeHasChildren(node); ++d) {
      const auto child = static_cast<unsigned>(code >> bits_below(d) & 7U);
      node = octree_.nodeChildExists(node, child) ? octree_.getNodeChild(node, child) : nullptr;
    }
    return node;
  }

  [[nodiscard]] std::shared_ptr<const Tile> tile_of(const octomap::OcTreeNode& node) const {
    auto tile = std::make_shared<Tile>();
    fill(*tile, node, {0, 0, 0}, kTileSide);
    tile->summarise();
    return tile;
  }
  void fill(Tile& tile, const octomap::OcTreeNode& node, VoxelIndex corner, int side) const {
    if (octree_.nodeHasChildren(&node)) {
      const int half = side / 2;
      for (unsigned i = 0; i < 8; ++i) {
        if (!octree_.nodeChildExists(&node, i)) continue;
        const VoxelIndex at{corner[0] + ((i & 1U) != 0 ? half : 0), corner[1] + ((i & 2U) != 0 ? half : 0),
                            corner[2] + ((i & 4U) != 0 ? half : 0)};
        fill(tile, *octree_.getNodeChild(&node, i), at, half);
      }
      return;
    }
    const bool is_occupied = octree_.isNodeOccupied(node);
    const auto steps = static_cast<std::int8_t>(quantised(node.getLogOdds(), tiles_.step));
    const auto row = ((std::uint64_t{1} << side) - 1) << corner[0];
    for (int z = corner[2]; z < corner[2] + side; ++z) {
      for (int y = corner[1]; y < corner[1] + side; ++y) {
        Tile::Word& word = tile.words[static_cast<std::size_t>(z)];
        word.known |= row << (8 * y);
        if (is_occupied) word.occupied |= row << (8 * y);
        const auto first = tile.log_odds.begin() + 64 * z + 8 * y + corner[0];
        std::fill(first, first + side, steps);
      }
    }
  }

  TileTree& tiles_;
  const octomap::OcTree& octree_;
  TileBounds window_;
};

using Changed = std::pair<VoxelIndex, std::shared_ptr<const Tile>>;

/// Where a tile lies below a node of this kind.
template <class Part>
std::size_t slot_of_tile(const VoxelIndex& tile) {
  const unsigned shift = kTileDepth - depth_of<typename Part::Child>();
  const unsigned mask = (1U << Part::kBits) - 1;
  const auto part = [&](std::size_t axis) {
    return static_cast<std::size_t>(static_cast<unsigned>(tile[axis]) >> shift & mask);
  };
  return part(0) | part(1) << Part::kBits | part(2) << (2 * Part::kBits);
}

template <class Part>
std::shared_ptr<const Part> replaced(const std::shared_ptr<const Part>& old, std::span<Changed> changed) {
  if constexpr (std::is_same_v<Part, Tile>) {
    return changed.front().second;
  } else {
    auto made = std::make_shared<Part>(*old);
    const auto slot = [](const Changed& item) { return slot_of_tile<Part>(item.first); };
    std::stable_sort(changed.begin(), changed.end(),
                     [&](const Changed& a, const Changed& b) { return slot(a) < slot(b); });
    for (std::size_t i = 0; i < changed.size();) {
      std::size_t end = i;
      while (end < changed.size() && slot(changed[end]) == slot(changed[i])) ++end;
      auto& child = made->children[slot(changed[i])];
      child = replaced<typename Part::Child>(child, changed.subspan(i, end - i));
      i = end;
    }
    return made;
  }
}

}  // namespace

TileTree empty_tiles(const octomap::OcTree& octree) {
  TileTree tiles;
  tiles.voxel = octree.getResolution();
  tiles.per_voxel = 1 / tiles.voxel;
  const double most =
      std::max(std::abs(octree.getClampingThresMinLog()), std::abs(octree.getClampingThresMaxLog()));
  tiles.step = std::max(most, 1e-3) / 127;
  tiles.uniform = std::make_shared<UniformTiles>();
  tiles.world = uniform_part<TileWorld>(*tiles.uniform, UniformTiles::kUnknown);
  return tiles;
}

TileTree rebuilt(TileTree tiles, const octomap::OcTree& octree, std::span<const TouchedCube> touched,
                 const TileBounds& window) {
  if (touched.empty()) return tiles;
  const std::lock_guard lock(tiles.uniform->mutex);
  Builder builder(tiles, octree, window);
  tiles.world = builder.build<TileWorld>(octree.getRoot(), 0, tiles.world, touched);
  tiles.index();
  return tiles;
}

TileTree with_tiles(TileTree tiles, std::vector<Changed> changed) {
  if (changed.empty()) return tiles;
  for (const Changed& item : changed) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tiles.bounds.first[axis] = std::min(tiles.bounds.first[axis], item.first[axis]);
      tiles.bounds.last[axis] = std::max(tiles.bounds.last[axis], item.first[axis]);
    }
  }
  tiles.world = replaced<TileWorld>(tiles.world, changed);
  tiles.index();
  return tiles;
}

TileBounds tiles_of(const Eigen::AlignedBox3d& box, double voxel) {
  TileBounds bounds;
  if (box.isEmpty()) return bounds;
  const auto index = [&](double metres) {
    const double tile = std::floor((metres / voxel + kTreeCentre) / kTileSide);
    return static_cast<int>(std::clamp(tile, -1.0, static_cast<double>(kTilesPerAxis)));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    bounds.first[i] = std::max(index(box.min()[axis]), 0);
    bounds.last[i] = std::min(index(box.max()[axis]), kTilesPerAxis - 1);
  }
  return bounds;
}

}  // namespace pade::mapping
