// The known voxels in tiles of 8 x 8 x 8, each a few 64-bit words, under a tree of 512 children to a node.
// All parts are constant once made and shared between the trees of successive frames, which copy only what
// lies between the root and a tile that changed.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <Eigen/Core>

#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {

/// A voxel counted from the lower corner of what the octree can address.
using VoxelIndex = std::array<int, 3>;

inline constexpr int kVoxelsPerAxis = 65536;
inline constexpr int kTileSide = 8;  // voxels
inline constexpr int kTilesPerAxis = kVoxelsPerAxis / kTileSide;

/// Log-odds of the known voxels of a tile, in steps of TileTree::step, by the low nine bits of the Morton
/// code. Most eighths of most tiles have one value all over, free or seen once: it is kept once.
class TileLogOdds {
 public:
  [[nodiscard]] std::int8_t operator[](std::size_t voxel) const {
    const std::size_t eighth = voxel / 64;
    if ((mixed_ >> eighth & 1U) == 0) return same_[eighth];
    const auto before = static_cast<std::size_t>(std::popcount(mixed_ & ((1U << eighth) - 1U)));
    return values_[64 * before + voxel % 64];
  }
  /// Whether all voxels have one value, where all are known.
  [[nodiscard]] bool is_same_all_over() const {
    for (const std::int8_t value : same_)
      if (value != same_[0]) return false;
    return mixed_ == 0;
  }
  void fill(std::int8_t value) {
    same_.fill(value);
    values_.clear();
    mixed_ = 0;
  }
  /// Bytes of memory beside those of the tile.
  [[nodiscard]] std::size_t memory() const { return values_.capacity(); }
  /// Of an eighth; each at most once, in rising order, on top of what fill() or nothing has left.
  void set_same(std::size_t eighth, std::int8_t value) { same_[eighth] = value; }
  void set_values(std::size_t eighth, const std::array<std::int8_t, 64>& values) {
    mixed_ |= 1U << eighth;
    values_.insert(values_.end(), values.begin(), values.end());
  }

 private:
  std::array<std::int8_t, 8> same_{};
  unsigned mixed_ = 0;               // a bit for each eighth that has values of its own
  std::vector<std::int8_t> values_;  // of those, one after the other
};

/// 8 x 8 x 8 voxels: word z, bit 8 y + x.
struct Tile {
  struct Word {
    std::uint64_t known = 0;
    std::uint64_t occupied = 0;
  };
  std::array<Word, 8> words{};
  TileLogOdds log_odds;
  bool any_occupied = false;
  bool any_unknown = true;

  /// Sets the two flags.
  void summarise();
  [[nodiscard]] Occupancy at(int x, int y, int z) const {
    const Word& word = words[static_cast<std::size_t>(z)];
    const int bit = 8 * y + x;
    if ((word.occupied >> bit & 1U) != 0) return Occupancy::occupied;
    return (word.known >> bit & 1U) != 0 ? Occupancy::free : Occupancy::unknown;
  }
};

/// A cube of as many children to a side as 2^bits. No child is null.
template <class Part, int bits>
struct TileNode {
  using Child = Part;
  static constexpr int kBits = bits;
  std::array<std::shared_ptr<const Part>, std::size_t{1} << (3 * bits)> children;
};
using TileGroup = TileNode<Tile, 3>;        ///< 64 voxels to a side
using TileRegion = TileNode<TileGroup, 3>;  ///< 512
using TileBlock = TileNode<TileRegion, 3>;  ///< 4096
using TileWorld = TileNode<TileBlock, 4>;   ///< 65536: all

/// Tiles that are the same all over are shared by all that have them, and so are the nodes above them.
struct UniformTiles;

/// Bounds in tiles, both ends included; empty if first > last.
struct TileBounds {
  VoxelIndex first{kTilesPerAxis, kTilesPerAxis, kTilesPerAxis};
  VoxelIndex last{-1, -1, -1};
};

/// Rounded towards zero; something below -1 or above kVoxelsPerAxis where it is NaN or does not fit.
inline int truncated(double value) {
#if defined(__SSE2__)
  return _mm_cvttsd_si32(_mm_set_sd(value));
#else
  return value > -2 && value < kVoxelsPerAxis ? static_cast<int>(value) : -2;
#endif
}

/// All tiles of a map. Copies share them.
struct TileTree {
  std::shared_ptr<const TileWorld> world;
  std::shared_ptr<UniformTiles> uniform;  ///< used only by the thread that makes a new tree
  TileBounds bounds;                      ///< nothing is known outside
  double voxel = 0;                       ///< m
  double per_voxel = 0;                   ///< 1 / voxel
  double step = 0;                        ///< of the log-odds in a tile
  float occupied = 0;                     ///< log-odds at and above which a voxel is occupied
  /// The groups within the bounds, x fastest, where they are not too many: a way past the upper nodes.
  std::vector<const TileGroup*> groups;
  VoxelIndex first_group{};
  VoxelIndex group_counts{};
  /// One that is unknown, and the tiles within the bounds, x fastest; empty where they are too many.
  std::vector<const Tile*> near_tiles;
  VoxelIndex near_first{};
  std::array<std::int64_t, 3> near_counts{};

  /// Makes `groups` and `near_tiles` anew; to be called where `world` or `bounds` has changed.
  void index();

  /// The tile of 8 voxels to a side; tile coordinates from 0 to kTilesPerAxis - 1.
  [[nodiscard]] const Tile& tile(int x, int y, int z) const {
    const auto slot = static_cast<std::size_t>((x & 7) | (y & 7) << 3 | (z & 7) << 6);
    return *group(x >> 3, y >> 3, z >> 3).children[slot];
  }
  [[nodiscard]] const TileGroup& group(int x, int y, int z) const {
    if (groups.empty()) return group_by_nodes(x, y, z);
    const auto dx = static_cast<unsigned>(x - first_group[0]);
    const auto dy = static_cast<unsigned>(y - first_group[1]);
    const auto dz = static_cast<unsigned>(z - first_group[2]);
    const auto nx = static_cast<unsigned>(group_counts[0]);
    const auto ny = static_cast<unsigned>(group_counts[1]);
    if (dx >= nx || dy >= ny || dz >= static_cast<unsigned>(group_counts[2])) return group_by_nodes(x, y, z);
    return *groups[(std::size_t{dz} * ny + dy) * nx + dx];
  }
  [[nodiscard]] const TileGroup& group_by_nodes(int x, int y, int z) const {
    const auto slot = [&](int shift, int bits) {
      const int mask = (1 << bits) - 1;
      return static_cast<std::size_t>((x >> shift & mask) | (y >> shift & mask) << bits |
                                      (z >> shift & mask) << (2 * bits));
    };
    return *world->children[slot(6, 4)]->children[slot(3, 3)]->children[slot(0, 3)];
  }
  /// State of the voxel that holds a point (world, m). NaN, or beyond what can be addressed: unknown.
  [[nodiscard]] Occupancy state_at(const Eigen::Vector3d& point) const {
    const int x = truncated(per_voxel * point.x() + kTreeCentre);
    const int y = truncated(per_voxel * point.y() + kTreeCentre);
    const int z = truncated(per_voxel * point.z() + kTreeCentre);
    if (near_tiles.empty()) [[unlikely]]
      return far_at(point);
    const std::int64_t dx = static_cast<unsigned>((x >> 3) - near_first[0]);
    const std::int64_t dy = static_cast<unsigned>((y >> 3) - near_first[1]);
    const std::int64_t dz = static_cast<unsigned>((z >> 3) - near_first[2]);
    // Without a branch, which points at random would mislead: all ones where the tile is in the index.
    const std::int64_t is_near =
        ((dx - near_counts[0]) & (dy - near_counts[1]) & (dz - near_counts[2])) >> 63;
    const std::int64_t place = ((dz * near_counts[1] + dy) * near_counts[0] + dx + 1) & is_near;
    const Tile::Word& word =
        near_tiles[static_cast<std::size_t>(place)]->words[static_cast<unsigned>(z) & 7U];
    const auto bit = (8 * static_cast<unsigned>(y) + (static_cast<unsigned>(x) & 7U)) & 63U;
    return static_cast<Occupancy>((word.known >> bit & 1U) + (word.occupied >> bit & 1U));
  }
  /// The same without `near_tiles`.
  [[nodiscard]] Occupancy far_at(const Eigen::Vector3d& point) const;
  /// Beyond what can be addressed: unknown.
  [[nodiscard]] Occupancy at(const VoxelIndex& v) const {
    constexpr auto kAll = static_cast<unsigned>(kVoxelsPerAxis);
    if (static_cast<unsigned>(v[0]) >= kAll || static_cast<unsigned>(v[1]) >= kAll ||
        static_cast<unsigned>(v[2]) >= kAll) {
      return Occupancy::unknown;
    }
    return tile(v[0] >> 3, v[1] >> 3, v[2] >> 3).at(v[0] & 7, v[1] & 7, v[2] & 7);
  }
};

}  // namespace pade::mapping
