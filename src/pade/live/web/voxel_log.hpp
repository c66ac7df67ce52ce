// The occupied voxels of a map in blocks, in the order in which they last changed: so that any client, new
// or slow, gets what it lacks, and never more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <unordered_map>
#include <vector>

#include "pade/io/recording/messages/display_messages.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::live {

/// Blocks of 32 voxels to a side that may have changed: their keys in blocks, 11 bits each, x lowest.
using TouchedBlocks = std::set<std::uint64_t>;
/// Adds those of a change; as many as a map has at most.
void add_touched(const mapping::MapChange& change, TouchedBlocks& blocks);

/// One thread.
class VoxelLog {
 public:
  /// The map is empty again.
  void begin_anew();
  /// Takes over what the map has in some blocks. Those whose occupied voxels are the same have not changed.
  void update(std::shared_ptr<const mapping::MapView> view, const TouchedBlocks& touched);

  /// Number of the newest change, at least 1; never smaller again.
  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  /// Occupied voxels of the map.
  [[nodiscard]] std::size_t occupied() const { return occupied_; }

  /// What a client needs that knows all changes up to number `known` (0: nothing): the oldest first, whole
  /// blocks until there are `most` voxels. `known` is then the newest of them. A client that knows nothing of
  /// this map is told to forget all first.
  [[nodiscard]] std::vector<io::CubeMarker> since(std::uint64_t& known, std::size_t most) const;

 private:
  struct Block {
    std::int32_t number = 0;
    std::uint64_t change = 0;  ///< its last
    std::uint64_t digest = 0;  ///< of its occupied voxels
    std::size_t occupied = 0;
  };
  std::shared_ptr<const mapping::MapView> view_;
  std::unordered_map<std::uint64_t, Block> blocks_;
  std::map<std::uint64_t, std::uint64_t> order_;  // change to block
  std::uint64_t newest_ = 1;
  std::uint64_t begun_ = 1;  // change with which this map began
  std::size_t occupied_ = 0;
  std::int32_t numbers_ = 0;
};

}  // namespace pade::live
