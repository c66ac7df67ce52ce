#include "pade/mapping/query/tile_builder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <mutex>
#include <optional>
#include <type_traits>

#include "pade/mapping/query/voxel_grid.hpp"
#include "pade/mapping/tiles/voxel_store.hpp"

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
  constexpr std::int64_t kMostGroups = 1U << 16U;
  constexpr std::int64_t kMostTiles = 1U << 17U;
  constexpr int kTilesOfAGroup = 8;
  groups.clear();
  near_tiles.clear();
  if (bounds.first[0] > bounds.last[0]) return;
  std::int64_t group_count = 1;
  std::int64_t tile_count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first_group[axis] = bounds.first[axis] / kTilesOfAGroup;
    group_counts[axis] = bounds.last[axis] / kTilesOfAGroup - first_group[axis] + 1;
    group_count *= group_counts[axis];
    near_counts[axis] = bounds.last[axis] - bounds.first[axis] + 1;
    tile_count *= near_counts[axis];
  }
  if (group_count > kMostGroups) return;
  groups.reserve(static_cast<std::size_t>(group_count));
  for (int z = 0; z < group_counts[2]; ++z)
    for (int y = 0; y < group_counts[1]; ++y)
      for (int x = 0; x < group_counts[0]; ++x)
        groups.push_back(&group_by_nodes(first_group[0] + x, first_group[1] + y, first_group[2] + z));
  // Rounded towards zero, a place below the first tile of all would be in it.
  const bool is_at_border = *std::min_element(bounds.first.begin(), bounds.first.end()) == 0;
  if (tile_count > kMostTiles || is_at_border) return;
  near_first = bounds.first;
  near_tiles.reserve(static_cast<std::size_t>(tile_count) + 1);
  near_tiles.push_back(&tile(0, 0, 0));
  for (int z = bounds.first[2]; z <= bounds.last[2]; ++z)
    for (int y = bounds.first[1]; y <= bounds.last[1]; ++y)
      for (int x = bounds.first[0]; x <= bounds.last[0]; ++x) near_tiles.push_back(&tile(x, y, z));
}

namespace {

std::int8_t quantised(float log_odds, float per_step) {
  const float steps = std::clamp(log_odds * per_step, -127.0F, 127.0F);
  return static_cast<std::int8_t>(
      static_cast<int>(steps + (steps < 0 ? -0.5F : 0.5F)));  // NOLINT(bugprone-incorrect-roundings)
}

/// Swaps two bits of the index of each bit of a word.
template <unsigned high, unsigned low>
std::uint64_t with_index_bits_swapped(std::uint64_t word) {
  constexpr unsigned kShift = (1U << high) - (1U << low);
  constexpr std::uint64_t kMoved = [] {
    std::uint64_t mask = 0;
    for (unsigned i = 0; i < 64; ++i)
      if ((i >> low & 1U) != 0 && (i >> high & 1U) == 0) mask |= std::uint64_t{1} << i;
    return mask;
  }();
  const std::uint64_t moved = (word ^ word >> kShift) & kMoved;
  return word ^ moved ^ moved << kShift;
}

/// 4 x 4 x 4 bits from Morton order to rows along x.
std::uint64_t in_rows(std::uint64_t word) {
  word = with_index_bits_swapped<4, 2>(word);
  word = with_index_bits_swapped<3, 2>(word);
  return with_index_bits_swapped<2, 1>(word);
}

/// Adds 4 x 4 x 4 bits in rows, an eighth of a tile, to the words of the tile.
void add_eighth(std::uint64_t rows, std::size_t eighth, std::uint64_t Tile::Word::*kind, Tile& tile) {
  const unsigned shift = ((eighth & 2U) != 0 ? 32U : 0U) + ((eighth & 1U) != 0 ? 4U : 0U);
  for (std::size_t z = 0; z < 4; ++z) {
    std::uint64_t slab = rows >> (16 * z) & 0xffffU;
    slab = (slab | slab << 8U) & 0x00ff00ffU;
    slab = (slab | slab << 4U) & 0x0f0f0f0fU;
    tile.words[((eighth & 4U) != 0 ? 4 : 0) + z].*kind |= slab << shift;
  }
}

/// One value if all known voxels of the eighth have it.
void add_log_odds(std::uint64_t known, std::size_t eighth, const std::array<std::int8_t, 64>& values,
                  TileLogOdds& log_odds) {
  const std::int8_t first = known == 0 ? 0 : values[static_cast<std::size_t>(std::countr_zero(known))];
  bool same = true;
  for (std::size_t i = 0; i < values.size(); ++i)
    same = same && ((known >> i & 1U) == 0 || values[i] == first);
  if (same) {
    log_odds.set_same(eighth, first);
  } else {
    log_odds.set_values(eighth, values);
  }
}

std::shared_ptr<const Tile> make_tile(const VoxelStore& voxels, const VoxelTile& from, float per_step) {
  auto tile = std::make_shared<Tile>();
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    add_eighth(in_rows(from.known[eighth]), eighth, &Tile::Word::known, *tile);
    add_eighth(in_rows(from.occupied[eighth]), eighth, &Tile::Word::occupied, *tile);
    if (from.values[eighth] == VoxelTile::kNoValues) {
      tile->log_odds.set_same(eighth, quantised(from.same[eighth], per_step));
      continue;
    }
    const EighthValues values = voxels.values_of(from, eighth);
    std::array<std::int8_t, 64> steps{};
    for (std::size_t i = 0; i < values.size(); ++i) steps[i] = quantised(values[i], per_step);
    add_log_odds(from.known[eighth], eighth, steps, tile->log_odds);
  }
  tile->summarise();
  return tile;
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

/// Walks the voxels of the map and the tiles together.
class Builder {
 public:
  Builder(TileTree& tiles, const VoxelStore& voxels, const TileBounds& window)
      : tiles_(tiles), voxels_(voxels), window_(window), per_step_(static_cast<float>(1 / tiles.step)) {}

  template <class Part>
  std::shared_ptr<const Part> build(std::uint64_t code, const std::shared_ptr<const Part>& old,
                                    std::span<const TouchedCube> touched) {
    if constexpr (std::is_same_v<Part, TileWorld>) {
      return node_of<Part>(code, old, touched);
    } else {
      const TileBounds place = place_of(code, depth_of<Part>());
      const auto unknown = [&] { return uniform_part<Part>(*tiles_.uniform, UniformTiles::kUnknown); };
      if (!touches(place)) return unknown();  // before it is asked for, which would unpack it
      const VoxelStore::Entry& entry = voxels_.find(code, depth_of<Part>());
      if (entry.part == VoxelStore::Entry::kUnknown) return unknown();
      if (!entry.has_parts() && is_inside(place)) {
        extend(place);
        return uniform_part<Part>(*tiles_.uniform, value_of(entry.value));
      }
      if constexpr (std::is_same_v<Part, Tile>) {
        extend(place);
        return make_tile(voxels_, voxels_.tile(entry), per_step_);
      } else {
        return node_of<Part>(code, old, touched);
      }
    }
  }

 private:
  static TileBounds place_of(std::uint64_t code, unsigned depth) {
    const VoxelKey key = morton_key(code);
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
  [[nodiscard]] int value_of(float log_odds) const {
    const int steps = quantised(log_odds, per_step_) + 128;
    return voxels_.is_occupied(log_odds) ? steps + 256 : steps;
  }

  template <class Part>
  std::shared_ptr<const Part> node_of(std::uint64_t code, const std::shared_ptr<const Part>& old,
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
        slot = build<Child>(child_code, slot, touched.first(count));
      }
      touched = touched.subspan(count);
    }
    return made;
  }

  template <class Part>
  static std::size_t slot_of(std::uint64_t code) {
    const VoxelKey key = morton_key(code);
    const unsigned shift = kTreeDepth - depth_of<typename Part::Child>();
    const unsigned mask = (1U << Part::kBits) - 1;
    return (key[0] >> shift & mask) | (key[1] >> shift & mask) << Part::kBits |
           (key[2] >> shift & mask) << (2 * Part::kBits);
  }

  TileTree& tiles_;
  const VoxelStore& voxels_;
  TileBounds window_;
  float per_step_;
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

TileTree empty_tiles(const VoxelStore& voxels, double voxel) {
  TileTree tiles;
  tiles.voxel = voxel;
  tiles.per_voxel = 1 / tiles.voxel;
  tiles.occupied = voxels.rules().occupied;
  const double most = std::max(std::abs(voxels.rules().least), std::abs(voxels.rules().most));
  tiles.step = std::max(most, 1e-3) / 127;
  tiles.uniform = std::make_shared<UniformTiles>();
  tiles.world = uniform_part<TileWorld>(*tiles.uniform, UniformTiles::kUnknown);
  return tiles;
}

TileTree rebuilt(TileTree tiles, const VoxelStore& voxels, std::span<const TouchedCube> touched,
                 const TileBounds& window) {
  if (touched.empty()) return tiles;
  const std::lock_guard lock(tiles.uniform->mutex);
  Builder builder(tiles, voxels, window);
  tiles.world = builder.build<TileWorld>(0, tiles.world, touched);
  tiles.index();
  return tiles;
}

std::shared_ptr<const Tile> with_free(const Tile& old, const std::array<std::uint64_t, 8>& words) {
  auto tile = std::make_shared<Tile>(old);
  std::array<std::uint64_t, 8> fresh{}, known{};  // in Morton order
  for (int z = 0; z < kTileSide; ++z) {
    Tile::Word& word = tile->words[static_cast<std::size_t>(z)];
    const std::uint64_t added = words[static_cast<std::size_t>(z)] & ~word.known;
    word.known |= added;
    for (int bit = 0; bit < 64; ++bit) {
      const std::size_t voxel = index_in_tile(bit & 7, bit >> 3, z);
      fresh[voxel / 64] |= (added >> bit & 1U) << voxel % 64;
      known[voxel / 64] |= (word.known >> bit & 1U) << voxel % 64;
    }
  }
  tile->log_odds.fill(0);
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    std::array<std::int8_t, 64> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = (fresh[eighth] >> i & 1U) != 0 ? std::int8_t{-127} : old.log_odds[64 * eighth + i];
    add_log_odds(known[eighth], eighth, values, tile->log_odds);
  }
  tile->summarise();
  return tile;
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
  if (!is_box(box)) return bounds;
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
