// The known voxels in tiles of 8 x 8 x 8, each a few 64-bit words, under a tree of 512 children to a node.
// All parts are constant once made and shared between the trees of successive frames, which copy only what
// lies between the root and a tile that changed.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

/// A voxel counted from the lower corner of what the octree can address.
using VoxelIndex = std::array<int, 3>;

inline constexpr int kVoxelsPerAxis = 65536;
inline constexpr int kTileSide = 8;  // voxels
inline constexpr int kTilesPerAxis = kVoxelsPerAxis / kTileSide;

/// 8 x 8 x 8 voxels: word z, bit 8 y + x.
struct Tile {
  struct Word {
    std::uint64_t known = 0;
    std::uint64_t occupied = 0;
  };
  std::array<Word, 8> words{};
  std::array<std::int8_t, 512>
      log_odds{};  ///< in steps of TileTree::step(), of known voxels, in Morton order
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

/// All tiles of a map. Copies share them.
struct TileTree {
  std::shared_ptr<const TileWorld> world;
  std::shared_ptr<UniformTiles> uniform;  ///< used only by the thread that makes a new tree
  TileBounds bounds;                      ///< nothing is known outside
  double voxel = 0;                       ///< m
  double per_voxel = 0;                   ///< 1 / voxel
  double step = 0;                        ///< of the log-odds in a tile
  /// The groups within the bounds, x fastest, where they are not too many: a way past the upper nodes.
  std::vector<const TileGroup*> groups;
  VoxelIndex first_group{};
  VoxelIndex group_counts{};

  /// Makes `groups` anew; to be called where `world` or `bounds` has changed.
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
