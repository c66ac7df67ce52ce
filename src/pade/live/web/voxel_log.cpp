#include "pade/live/web/voxel_log.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::live {
namespace {

constexpr int kBlockTiles = 4;  // of 8 voxels, to a side of a block
constexpr int kBlockBits = 11;  // of a coordinate in blocks
constexpr int kBlocksPerAxis = 1 << kBlockBits;

std::uint64_t key_of_block(int x, int y, int z) {
  return static_cast<std::uint64_t>(x) | static_cast<std::uint64_t>(y) << kBlockBits |
         static_cast<std::uint64_t>(z) << (2 * kBlockBits);
}

/// Calls `visitor` with tile coordinates and tile, of those of a block that have an occupied voxel.
template <class Visitor>
void for_each_occupied_tile(const mapping::TileTree& tiles, std::uint64_t block, const Visitor& visitor) {
  constexpr std::uint64_t kMask = kBlocksPerAxis - 1;
  const std::array<int, 3> first = {kBlockTiles * static_cast<int>(block & kMask),
                                    kBlockTiles * static_cast<int>(block >> kBlockBits & kMask),
                                    kBlockTiles * static_cast<int>(block >> (2 * kBlockBits) & kMask)};
  for (int z = first[2]; z < first[2] + kBlockTiles; ++z)
    for (int y = first[1]; y < first[1] + kBlockTiles; ++y)
      for (int x = first[0]; x < first[0] + kBlockTiles; ++x) {
        const mapping::Tile& tile = tiles.tile(x, y, z);
        if (tile.any_occupied) visitor(mapping::VoxelIndex{x, y, z}, tile);
      }
}

/// Of MurmurHash3's last step: no two of a few thousand states of a block have the same, in practice.
std::uint64_t stirred(std::uint64_t value) {
  value = (value ^ value >> 33) * 0xff51afd7ed558ccdULL;
  value = (value ^ value >> 33) * 0xc4ceb9fe1a85ec53ULL;
  return value ^ value >> 33;
}

/// Colours go round every ten metres of height, as a rainbow does from red to violet.
std::array<float, 3> colour_of_height(float z) {
  constexpr float kRound = 10;  // m
  const float hue = 6 * (z / kRound - std::floor(z / kRound));
  const auto part = [&](float offset) {
    const float k = std::fmod(offset + hue, 6.0F);
    return 1 - 0.75F * std::clamp(std::min(k, 4 - k), 0.0F, 1.0F);
  };
  return {part(5), part(3), part(1)};
}

void add_cubes(const mapping::VoxelIndex& at, const mapping::Tile& tile, double voxel,
               io::CubeMarker& marker) {
  for (int z = 0; z < mapping::kTileSide; ++z) {
    for (std::uint64_t rest = tile.words[static_cast<std::size_t>(z)].occupied; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest);
      const mapping::VoxelKey key = {static_cast<std::uint16_t>(mapping::kTileSide * at[0] + bit % 8),
                                     static_cast<std::uint16_t>(mapping::kTileSide * at[1] + bit / 8),
                                     static_cast<std::uint16_t>(mapping::kTileSide * at[2] + z)};
      marker.centres.emplace_back(mapping::centre_of(key, voxel).cast<float>());
      marker.colours.push_back(colour_of_height(marker.centres.back().z()));
    }
  }
}

}  // namespace

void add_touched(const mapping::MapChange& change, TouchedBlocks& blocks) {
  constexpr int kBlockVoxels = mapping::kTileSide * kBlockTiles;
  std::uint64_t last = ~std::uint64_t{0};  // neighbours in the list are neighbours in space
  for (const mapping::MapCell& cell : change.touched) {
    const int side = 1 << (mapping::kTreeDepth - cell.depth);  // voxels
    const int count = std::max(1, side / kBlockVoxels);
    const std::array<int, 3> first = {cell.key[0] / kBlockVoxels, cell.key[1] / kBlockVoxels,
                                      cell.key[2] / kBlockVoxels};
    for (int z = 0; z < count; ++z)
      for (int y = 0; y < count; ++y)
        for (int x = 0; x < count; ++x) {
          const std::uint64_t block = key_of_block(first[0] + x, first[1] + y, first[2] + z);
          if (block != last) blocks.insert(block);
          last = block;
        }
  }
}

void VoxelLog::begin_anew() {
  view_.reset();
  blocks_.clear();
  order_.clear();
  begun_ = ++newest_;
  occupied_ = 0;
}

void VoxelLog::update(std::shared_ptr<const mapping::MapView> view, const TouchedBlocks& touched) {
  view_ = std::move(view);
  for (const std::uint64_t key : touched) {
    std::uint64_t digest = 0;
    std::size_t occupied = 0;
    for_each_occupied_tile(view_->tiles(), key,
                           [&](const mapping::VoxelIndex& at, const mapping::Tile& tile) {
                             digest = stirred(digest + key_of_block(at[0], at[1], at[2]));
                             for (const auto& word : tile.words) {
                               digest = stirred(digest ^ word.occupied) + 1;
                               occupied += static_cast<std::size_t>(std::popcount(word.occupied));
                             }
                           });
    const auto found = blocks_.find(key);
    if (found == blocks_.end() && occupied == 0) continue;
    Block& block = found == blocks_.end() ? blocks_[key] : found->second;
    if (block.change != 0 && block.digest == digest) continue;
    if (block.change == 0) {
      block.number = numbers_++;
    } else {
      order_.erase(block.change);
    }
    occupied_ += occupied - block.occupied;
    block.digest = digest;
    block.occupied = occupied;
    block.change = ++newest_;
    order_.emplace(block.change, key);
  }
}

std::vector<io::CubeMarker> VoxelLog::since(std::uint64_t& known, std::size_t most) const {
  std::vector<io::CubeMarker> markers;
  const bool is_new = known < begun_;
  if (is_new) {
    known = begun_;
    markers.emplace_back().action = io::CubeMarker::Action::remove_all;
  }
  std::size_t count = 0;
  for (auto at = order_.upper_bound(known); at != order_.end() && count < most; ++at) {
    known = at->first;
    const Block& block = blocks_.at(at->second);
    if (block.occupied == 0 && is_new) continue;
    io::CubeMarker& marker = markers.emplace_back();
    marker.number = block.number;
    if (block.occupied == 0) {
      marker.action = io::CubeMarker::Action::remove;
      continue;
    }
    const double voxel = view_->voxel();
    marker.side = voxel;
    for_each_occupied_tile(view_->tiles(), at->second,
                           [&](const mapping::VoxelIndex& tile_at, const mapping::Tile& tile) {
                             add_cubes(tile_at, tile, voxel, marker);
                           });
    count += marker.centres.size();
  }
  return markers;
}

}  // namespace pade::live
