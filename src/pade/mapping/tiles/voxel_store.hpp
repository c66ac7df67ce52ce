// What the map knows of each voxel: log-odds in tiles of 8 x 8 x 8 under nodes of 512 parts. Whatever is the
// same all over, free or unknown, is one entry of the node above it, however large it is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {

/// The probabilities of MapOptions in log-odds, rounded to float as OctoMap does.
struct LogOdds {
  explicit LogOdds(const MapOptions& options);
  float hit, miss;
  float least, most;
  float occupied;  ///< at and above
};

/// An update of one voxel.
struct VoxelHit {
  std::uint64_t code = 0;
  float change = 0;  ///< of the log-odds
};

/// Voxels of one tile or of a larger cube that an image shows free.
struct FreeCube {
  std::uint64_t code = 0;  ///< Morton code of its lower corner
  unsigned depth = kTileDepth;
  /// Of a tile: by eighths, bit = low six bits of the Morton code. A larger cube is free as a whole.
  std::array<std::uint64_t, 8> voxels{};
};

/// 8 x 8 x 8 voxels in Morton order: words by eighths, bit = low six bits of the code.
struct VoxelTile {
  std::array<std::uint64_t, 8> known{};
  std::array<std::uint64_t, 8> occupied{};
  std::array<std::uint64_t, 8> least{};  ///< known and as free as can be: a miss changes nothing
  static constexpr std::uint32_t kNoValues = 0xffffffff;
  /// Of an eighth: where its log-odds lie, or that all of its known voxels have the one of `same`.
  std::array<std::uint32_t, 8> values{kNoValues, kNoValues, kNoValues, kNoValues,
                                      kNoValues, kNoValues, kNoValues, kNoValues};
  std::array<float, 8> same{};

  /// All known, with one log-odds.
  [[nodiscard]] bool is_uniform() const {
    for (std::size_t eighth = 0; eighth < 8; ++eighth)
      if (~known[eighth] != 0 || values[eighth] != kNoValues || same[eighth] != same[0]) return false;
    return true;
  }
};

/// Log-odds of an eighth of a tile; of unknown voxels 0.
using EighthValues = std::array<float, 64>;

/// Side of the cubes that are packed, voxels.
inline constexpr int kPackedSide = 64;

/// All voxels of a map.
class VoxelStore {
 public:
  /// What is below a node: nothing, one state all over, or parts, which may be packed.
  struct Entry {
    static constexpr std::uint32_t kUnknown = 0xffffffff;
    static constexpr std::uint32_t kUniform = 0xfffffffe;
    static constexpr std::uint32_t kPacked = 0x80000000;
    std::uint32_t part = kUnknown;  ///< or the number of the node or tile, or kPacked + that of the bytes
    float value = 0;                ///< log-odds, if uniform
    [[nodiscard]] bool has_parts() const { return part < kPacked; }
    [[nodiscard]] bool is_packed() const { return part >= kPacked && part < kUniform; }
    bool operator==(const Entry& other) const = default;
  };
  using Node = std::array<Entry, 512>;  ///< in Morton order

  VoxelStore(const LogOdds& rules, double voxel);

  [[nodiscard]] const LogOdds& rules() const { return rules_; }
  [[nodiscard]] bool empty() const { return empty_; }

  /// The entry of the smallest cube that is at this depth or above: 4, 7, 10 or 13 = a tile. Unpacks.
  [[nodiscard]] const Entry& find(std::uint64_t code, unsigned depth) const;
  [[nodiscard]] const VoxelTile& tile(const Entry& entry) const {
    return tiles_[entry.part >> 8U][entry.part & 255U];
  }
  /// Log-odds of an eighth of a tile.
  [[nodiscard]] EighthValues values_of(const VoxelTile& tile, std::size_t eighth) const;
  /// Log-odds of a voxel; false if it is unknown.
  bool value_at(std::uint64_t code, float& log_odds) const;
  [[nodiscard]] bool is_occupied(float log_odds) const { return log_odds >= rules_.occupied; }
  /// Whether a miss changes nothing in the cube as a whole.
  [[nodiscard]] bool is_least(const Entry& entry) const {
    return entry.part == Entry::kUniform && entry.value <= rules_.least;
  }
  /// Voxels of a cube in which a miss changes nothing.
  [[nodiscard]] std::uint64_t count_least(std::uint64_t code, unsigned depth) const;

  /// Hits, and misses where an image shows free, in one pass. What changed is appended to `change`.
  /// @param free  in Morton order, disjoint, without the voxels of `hits`
  /// @param hits  in Morton order
  void apply(std::span<const FreeCube> free, std::span<const VoxelHit> hits, MapChange& change);
  /// What is free of these voxels of a tile becomes unknown.
  void forget_free(std::uint64_t tile_code, const std::array<std::uint64_t, 8>& voxels, MapChange& change);
  /// Sets all of a cube.
  void set(std::uint64_t code, unsigned depth, float log_odds);

  /// Calls visitor(code, depth, log_odds) for every known cube of one value, as large as they can be, in the
  /// order of the octree.
  template <class Visitor>
  void for_each(const Visitor& visitor) const {
    leaves_of(root_, 0, 0, visitor);
  }
  /// Packs what is farther from a point than `distance`, by cubes of kPackedSide voxels to a side. What is
  /// asked for, or changes, is unpacked again; to the last bit it is what it was.
  /// @param voxel  coordinates of the point's voxel. @param distance  in voxels
  void pack_beyond(const VoxelKey& voxel, double distance);
  /// Of memory, in bytes: of what is not packed with what stands ready for more, and of what is packed.
  [[nodiscard]] std::size_t memory() const;
  [[nodiscard]] std::size_t packed_memory() const { return packed_bytes_; }

 private:
  static constexpr unsigned kRootDepth = 4;   // of the root's entries
  static constexpr unsigned kPackDepth = 10;  // of what is packed
  using Bytes = std::vector<std::uint8_t>;

  template <class Visitor>
  void leaves_of(std::span<const Entry> entries, std::uint64_t code, unsigned depth,
                 const Visitor& visitor) const;
  template <class Visitor>
  void leaves_of(const VoxelTile& tile, std::uint64_t code, const Visitor& visitor) const;

  std::uint32_t new_tile() const;
  std::uint32_t new_node(const Entry& all) const;
  void free_parts(Entry& entry, unsigned depth) const;
  /// Of voxel_packing.cpp.
  void pack_parts(std::span<Entry> entries, std::uint64_t code, unsigned depth, const VoxelKey& voxel,
                  double distance);
  [[nodiscard]] Bytes packed(const Node& node) const;
  void unpack(Entry& entry) const;
  void unpack_node(const Bytes& bytes, Node& node) const;
  Bytes release_packed(const Entry& entry) const;
  [[nodiscard]] VoxelTile& own_tile(const Entry& entry) const {
    return tiles_[entry.part >> 8U][entry.part & 255U];
  }
  VoxelTile& opened_tile(Entry& entry);
  /// The log-odds of an eighth to write to, and what is to be called when they are written: where all of the
  /// known ones are the same again they are kept as one.
  [[nodiscard]] EighthValues& opened_eighth(VoxelTile& tile, std::size_t eighth) const;
  void close_eighth(VoxelTile& tile, std::size_t eighth) const;
  void free_eighth(VoxelTile& tile, std::size_t eighth) const;
  [[nodiscard]] EighthValues& own_values(std::uint32_t number) const {
    return values_[number >> 8U][number & 255U];
  }
  Node& opened_node(Entry& entry);
  void join(Entry& entry, unsigned depth, const Entry& part);
  void fill(VoxelTile& tile, float log_odds) const;
  /// The masks of a tile from its log-odds and what is known.
  void mark(VoxelTile& tile) const;
  [[nodiscard]] float added(float log_odds, float change) const;

  template <class Update>
  void descend(Entry& entry, unsigned depth, std::uint64_t code, unsigned to, const Update& update);
  bool miss_all(Entry& entry, std::uint64_t code, unsigned depth, MapChange& change);
  void update_tile(Entry& entry, const FreeCube& free, std::span<const VoxelHit> hits, MapChange& change);
  void miss_cube(const FreeCube& cube, MapChange& change);
  void miss(VoxelTile& tile, std::size_t eighth, std::uint64_t voxels) const;
  void put(VoxelTile& tile, std::size_t voxel, float log_odds) const;

  LogOdds rules_;
  double voxel_;
  bool empty_ = true;
  std::vector<Entry> root_;  // 4096
  // Asking unpacks: what a const function says is the same before and after, where it is kept is not.
  mutable std::vector<std::unique_ptr<Node>> nodes_;
  mutable std::vector<std::unique_ptr<VoxelTile[]>> tiles_;      // 256 each NOLINT(*-avoid-c-arrays)
  mutable std::vector<std::unique_ptr<EighthValues[]>> values_;  // likewise NOLINT(*-avoid-c-arrays)
  mutable std::vector<std::uint32_t> spare_nodes_, spare_tiles_, spare_values_;
  mutable std::vector<Bytes> packed_;
  mutable std::vector<std::uint32_t> spare_packed_;
  mutable std::size_t packed_bytes_ = 0;
};

template <class Visitor>
void VoxelStore::leaves_of(std::span<const Entry> entries, std::uint64_t code, unsigned depth,
                           const Visitor& visitor) const {
  // Entries of one cube, at most the 4096 of all or the 512 of a node: one leaf if they are the same.
  const Entry& first = entries.front();
  bool same = !first.has_parts() && !first.is_packed();
  for (std::size_t i = 1; same && i < entries.size(); ++i) same = entries[i] == first;
  if (same) {
    if (first.part == Entry::kUniform) visitor(code, depth, first.value);
    return;
  }
  if (entries.size() > 1) {
    const std::size_t eighth = entries.size() / 8;
    for (std::size_t i = 0; i < 8; ++i) {
      leaves_of(entries.subspan(i * eighth, eighth), code + i * voxels_of(depth + 1), depth + 1, visitor);
    }
    return;
  }
  if (depth == kTileDepth) {
    leaves_of(tile(first), code, visitor);
  } else if (first.is_packed()) {  // a walk over all leaves it packed
    Entry open{new_node({}), 0};
    unpack_node(packed_[first.part - Entry::kPacked], *nodes_[open.part]);
    leaves_of(*nodes_[open.part], code, depth, visitor);
    free_parts(open, depth);
  } else {
    leaves_of(*nodes_[first.part], code, depth, visitor);
  }
}

template <class Visitor>
void VoxelStore::leaves_of(const VoxelTile& tile, std::uint64_t code, const Visitor& visitor) const {
  if (tile.is_uniform()) return visitor(code, kTileDepth, tile.same[0]);
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    const std::uint64_t known = tile.known[eighth];
    if (known == 0) continue;
    const std::size_t base = 64 * eighth;
    const EighthValues values = values_of(tile, eighth);
    const auto same = [&](std::size_t from, std::size_t count) {
      bool yes = true;
      for (std::size_t i = from + 1; yes && i < from + count; ++i) yes = values[i] == values[from];
      return yes;
    };
    if (~known == 0 && same(0, 64)) {
      visitor(code + base, kTileDepth + 1, values[0]);
      continue;
    }
    for (std::size_t i = 0; i < 64; i += 8) {
      const auto eight = static_cast<unsigned>(known >> i & 255U);
      if (eight == 255 && same(i, 8)) {
        visitor(code + base + i, kTileDepth + 2, values[i]);
        continue;
      }
      for (std::size_t k = 0; k < 8; ++k) {
        if ((eight >> k & 1U) != 0) visitor(code + base + i + k, kTreeDepth, values[i + k]);
      }
    }
  }
}

}  // namespace pade::mapping
