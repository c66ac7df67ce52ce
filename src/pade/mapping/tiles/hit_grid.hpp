// How many points of an image lie in each voxel, in tiles, so that the voxels around one are found fast.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {

/// Cleared at a cost proportional to what was used.
class HitGrid {
 public:
  static constexpr std::uint32_t kCertain = 256;
  struct Count {
    std::uint32_t points = 0;
    std::uint32_t certainty =
        0;  ///< sum over its points of the probability that it lies here, in units of 1 / kCertain
  };
  struct Tile {
    VoxelKey key{};                      ///< of its lower corner
    std::uint64_t code = 0;              ///< its Morton code
    std::array<std::uint64_t, 8> hit{};  ///< by eighths, bit = low six bits of the Morton code
    std::array<Count, 512> counts{};     ///< in Morton order
  };
  /// A tile and those around it, null where nothing was hit; x fastest, itself in the middle.
  using Around = std::array<const Tile*, 27>;

  /// @param key  x | y << 16 | z << 32
  void add(std::uint64_t key, std::uint32_t points, std::uint32_t certainty);
  void clear();
  /// In Morton order.
  [[nodiscard]] std::vector<const Tile*> tiles() const;
  [[nodiscard]] Around around(const Tile& tile) const;

 private:
  struct Slot {
    std::uint64_t corner = 0;  // key of a tile's lower corner, packed
    Tile* tile = nullptr;
  };
  [[nodiscard]] std::size_t slot_of(std::uint64_t corner) const;
  [[nodiscard]] const Tile* find(std::uint64_t corner) const;
  Tile& opened(std::uint64_t corner);
  void grow();

  std::vector<Slot> slots_;
  std::vector<std::unique_ptr<Tile>> tiles_;  // the first `used_`
  std::size_t used_ = 0;
  std::uint64_t last_corner_ = 0;
  Tile* last_ = nullptr;  // neighbouring pixels mostly hit the same tile
};

/// Where the voxel before one, itself and the next one along an axis lie: in which tile of Around, and at
/// which index of it.
struct AxisNeighbours {
  AxisNeighbours(int coordinate, std::size_t tiles, unsigned axis) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int at = (coordinate & 7) + static_cast<int>(i) - 1;
      tile[i] = tiles * static_cast<std::size_t>(1 + (at >> 3));
      index[i] = kSpreadBits[static_cast<std::size_t>(at & 7)] << axis;
    }
  }
  std::array<std::size_t, 3> tile{};
  std::array<std::size_t, 3> index{};
};

/// Whether a voxel next to one, or itself, has more points.
inline bool has_fuller_neighbour(const HitGrid::Around& around, const VoxelKey& key, double points) {
  const AxisNeighbours x(key[0], 1, 0), y(key[1], 3, 1), z(key[2], 9, 2);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        const HitGrid::Tile* tile = around[x.tile[i] + y.tile[j] + z.tile[k]];
        if (tile != nullptr && tile->counts[x.index[i] | y.index[j] | z.index[k]].points > points)
          return true;
      }
    }
  }
  return false;
}

/// Points in a voxel of `around` or up to a tile away from it, whose key is given; 0 farther away.
inline std::uint32_t points_at(const HitGrid::Around& around, const VoxelKey& middle, int x, int y, int z) {
  const int dx = (x >> 3) - (middle[0] >> 3) + 1;
  const int dy = (y >> 3) - (middle[1] >> 3) + 1;
  const int dz = (z >> 3) - (middle[2] >> 3) + 1;
  const HitGrid::Tile* tile = around[static_cast<std::size_t>(dx + 3 * dy + 9 * dz)];
  return tile == nullptr ? 0 : tile->counts[index_in_tile(x, y, z)].points;
}

}  // namespace pade::mapping
