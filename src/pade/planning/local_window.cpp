#include "pade/planning/local_window.hpp"

#include <algorithm>
#include <cmath>

#include "pade/mapping/query/tile_tree.hpp"

namespace pade::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
constexpr int kWordBits = 64;
constexpr int kTile = mapping::kTileSide;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

}  // namespace

void LocalWindow::resize(const Vector3d& centre) {
  // Whole tiles.
  const Vector3i first_tile = ((centre - half_size_) / (kTile * voxel_)).array().floor().cast<int>();
  const Vector3i end_tile = ((centre + half_size_) / (kTile * voxel_)).array().ceil().cast<int>();
  first_ = kTile * first_tile;
  size_ = kTile * (end_tile - first_tile);
  words_ = (size_.x() + kWordBits - 1) / kWordBits;
  const auto words = row(0, size_.z());
  free_.assign(words, 0);
  occupied_.assign(words, 0);
  unfree_.resize(words);
  occupied_near_.resize(words);
  unfree_near_.resize(words);
}

void LocalWindow::take(const mapping::MapView& map) {
  const mapping::TileTree& tiles = map.tiles();
  const Vector3i first_tile = (first_.array() + mapping::kVoxelsPerAxis / 2) / kTile;
  const Vector3i tiles_of_box = size_ / kTile;
  const auto is_addressed = [](int tile) { return tile >= 0 && tile < mapping::kTilesPerAxis; };
  for (int tz = 0; tz < tiles_of_box.z(); ++tz) {
    for (int ty = 0; ty < tiles_of_box.y(); ++ty) {
      for (int tx = 0; tx < tiles_of_box.x(); ++tx) {
        const Vector3i at = first_tile + Vector3i(tx, ty, tz);
        if (!is_addressed(at.x()) || !is_addressed(at.y()) || !is_addressed(at.z())) continue;
        copy(tiles.tile(at.x(), at.y(), at.z()), kTile * Vector3i(tx, ty, tz));
      }
    }
  }
}

/// A tile has a byte for each of its rows along x.
void LocalWindow::copy(const mapping::Tile& tile, const Vector3i& corner) {
  constexpr std::uint64_t kByte = 255;
  const auto word = static_cast<std::size_t>(corner.x() / kWordBits);
  const int shift = corner.x() % kWordBits;
  for (int z = 0; z < kTile; ++z) {
    const auto slice = static_cast<std::size_t>(z);
    for (int y = 0; y < kTile; ++y) {
      const std::size_t to = row(corner.y() + y, corner.z() + z) + word;
      const std::uint64_t occupied = tile.words[slice].occupied >> (kTile * y) & kByte;
      const std::uint64_t known = tile.words[slice].known >> (kTile * y) & kByte;
      occupied_[to] |= occupied << shift;
      free_[to] |= (known & ~occupied) << shift;
    }
  }
}

/// Into rows_: bits of `from`, each spread by `reach` voxels along x.
void LocalWindow::spread_rows(const Bits& from, int reach, bool beyond) {
  rows_.resize(from.size());
  const std::uint64_t outside = beyond ? kAll : 0;
  const auto words = static_cast<std::size_t>(words_);
  for (std::size_t start = 0; start < from.size(); start += words) {
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint64_t here = from[start + w];
      const std::uint64_t left = w > 0 ? from[start + w - 1] : outside;
      const std::uint64_t right = w + 1 < words ? from[start + w + 1] : outside;
      std::uint64_t bits = here;
      for (int i = 1; i <= std::min(reach, kWordBits - 1); ++i)
        bits |= (here << i) | (here >> i) | (left >> (kWordBits - i)) | (right << (kWordBits - i));
      for (int i = kWordBits; i <= reach; ++i) {
        const int away = i / kWordBits;
        const int shift = i % kWordBits;
        const auto word = [&](int offset) {
          const int at = static_cast<int>(w) + offset;
          return at >= 0 && at < words_ ? from[start + static_cast<std::size_t>(at)] : outside;
        };
        bits |= (word(-away) << shift) | (word(away) >> shift);
        if (shift > 0)
          bits |= (word(-away - 1) >> (kWordBits - shift)) | (word(away + 1) << (kWordBits - shift));
      }
      rows_[start + w] = bits;
    }
  }
}

/// A ball about any point of a voxel reaches the voxel that is d away along an axis if it spans d - 1 of
/// them.
void LocalWindow::spread(const Bits& from, double radius, bool beyond, Bits& to) {
  const int most = static_cast<int>(radius / voxel_) + 1;
  const auto gap = [](int d) { return std::max(std::abs(d) - 1, 0); };
  const double limit = (radius / voxel_) * (radius / voxel_);
  std::fill(to.begin(), to.end(), beyond && most >= size_.z() ? kAll : 0);
  for (int reach = 0; reach <= most; ++reach) {
    spread_rows(from, reach, beyond);
    for (int dz = -most; dz <= most; ++dz) {
      for (int dy = -most; dy <= most; ++dy) {
        const int across = gap(dy) * gap(dy) + gap(dz) * gap(dz);
        if (across + gap(reach) * gap(reach) >= limit) continue;         // too far
        if (across + gap(reach + 1) * gap(reach + 1) < limit) continue;  // a longer reach holds it
        for (int z = 0; z < size_.z(); ++z) {
          for (int y = 0; y < size_.y(); ++y) {
            const bool in = y + dy >= 0 && y + dy < size_.y() && z + dz >= 0 && z + dz < size_.z();
            if (!in && !beyond) continue;
            const std::size_t target = row(y, z);
            const std::size_t source = in ? row(y + dy, z + dz) : 0;
            for (std::size_t w = 0; w < static_cast<std::size_t>(words_); ++w)
              to[target + w] |= in ? rows_[source + w] : kAll;
          }
        }
      }
    }
  }
}

void LocalWindow::set(const mapping::MapView& map, const Vector3d& centre, double radius) {
  voxel_ = map.voxel();
  resize(centre);
  take(map);
  for (std::size_t i = 0; i < free_.size(); ++i) unfree_[i] = ~free_[i];
  spread(occupied_, radius, false, occupied_near_);
  spread(unfree_, radius, true, unfree_near_);
}

bool LocalWindow::bit(const Bits& bits, const Vector3d& point, bool beyond) const {
  const Vector3i at = Vector3i((point / voxel_).array().floor().cast<int>()) - first_;
  if ((at.array() < 0).any() || (at.array() >= size_.array()).any()) return beyond;
  return (bits[row(at.y(), at.z()) + static_cast<std::size_t>(at.x() / kWordBits)] >> (at.x() % kWordBits) &
          1) != 0;
}

mapping::Occupancy LocalWindow::at(const Vector3d& point) const {
  if (bit(occupied_, point, false)) return mapping::Occupancy::occupied;
  return bit(free_, point, false) ? mapping::Occupancy::free : mapping::Occupancy::unknown;
}

}  // namespace pade::planning
