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
    std::uint64_t code = 0;              ///< Morton code of its lower corner
    std::array<std::uint64_t, 8> hit{};  ///< by eighths, bit = low six bits of the Morton code
    std::array<Count, 512> counts{};     ///< in Morton order
  };
  /// A tile and those around it, null where nothing was hit; x fastest, itself in the middle.
  using Around = std::array<const Tile*, 27>;

  void add(const VoxelKey& key, std::uint32_t points, std::uint32_t certainty);
  void clear();
  /// In Morton order.
  [[nodiscard]] std::vector<const Tile*> tiles() const;
  [[nodiscard]] Around around(const Tile& tile) const;

 private:
  [[nodiscard]] std::size_t slot_of(std::uint64_t tile) const;
  [[nodiscard]] const Tile* find(std::uint64_t tile) const;
  Tile& opened(std::uint64_t tile);
  void grow();

  std::vector<std::uint32_t> slots_;          // number of a tile plus one; 0 = empty
  std::vector<std::unique_ptr<Tile>> tiles_;  // the first `used_`
  std::size_t used_ = 0;
  Tile* last_ = nullptr;  // neighbouring pixels mostly hit the same tile
};

/// Points in a voxel of `around` or up to a tile away from it, whose key is given; 0 farther away.
inline std::uint32_t points_at(const HitGrid::Around& around, const VoxelKey& middle, int x, int y, int z) {
  const int dx = (x >> 3) - (middle[0] >> 3) + 1;
  const int dy = (y >> 3) - (middle[1] >> 3) + 1;
  const int dz = (z >> 3) - (middle[2] >> 3) + 1;
  const HitGrid::Tile* tile = around[static_cast<std::size_t>(dx + 3 * dy + 9 * dz)];
  return tile == nullptr ? 0 : tile->counts[index_in_tile(x, y, z)].points;
}

}  // namespace pade::mapping
