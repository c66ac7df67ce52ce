// The known voxels in tiles of 8 x 8 x 8, each a few 64-bit words, under a tree of 512 children to a node.
// All parts are constant once made and shared between the trees of successive frames, which copy only what
// lies between the root and a tile that changed.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

/// A voxel counted from the lower corner of what the octree can address.
using VoxelIndex = std::array<int, 3>;

inline constexpr int kVoxelsPerAxis = 65536;
inline constexpr int kTileSide = 8;  // voxels
inline constexpr int kTilesPerAxis = kVoxelsPerAxis / kTileSide;

/// 8 x 8 x 8 voxels: word z, bit 8 y + x.
struct Tile {
  std::array<std::uint64_t, 8> known{};
  std::array<std::uint64_t, 8> occupied{};
  std::array<std::int8_t, 512> log_odds{};  ///< in steps of TileTree::step(), of known voxels
  bool any_occupied = false;
  bool any_unknown = true;

  /// Sets the two flags.
  void summarise();
  [[nodiscard]] Occupancy at(int x, int y, int z) const {
    const auto word = static_cast<std::size_t>(z);
    const int bit = 8 * y + x;
    if ((occupied[word] >> bit & 1U) != 0) return Occupancy::occupied;
    return (known[word] >> bit & 1U) != 0 ? Occupancy::free : Occupancy::unknown;
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

/// All tiles of a map. Copying it costs nothing.
struct TileTree {
  std::shared_ptr<const TileWorld> world;
  std::shared_ptr<UniformTiles> uniform;  ///< used only by the thread that makes a new tree
  TileBounds bounds;                      ///< nothing is known outside
  double voxel = 0;                       ///< m
  double step = 0;                        ///< of the log-odds in a tile

  /// The tile of 8 voxels to a side; tile coordinates from 0 to kTilesPerAxis - 1.
  [[nodiscard]] const Tile& tile(int x, int y, int z) const {
    const auto index = [&](int shift, int mask) {
      const int bits = mask == 15 ? 4 : 3;
      return static_cast<std::size_t>((x >> shift & mask) | (y >> shift & mask) << bits |
                                      (z >> shift & mask) << (2 * bits));
    };
    return *world->children[index(9, 15)]->children[index(6, 7)]->children[index(3, 7)]->children[index(0,
                                                                                                        7)];
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
