#include "pade/planning/local_window.hpp"

#include <algorithm>
#include <cmath>

#include <octomap/OcTree.h>

namespace pade::planning {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
constexpr int kWordBits = 64;
constexpr int kTreeCentre = 32768;  // key of the voxel just above the origin
constexpr std::uint64_t kAll = ~std::uint64_t{0};

}  // namespace

void LocalWindow::resize(const Vector3d& centre) {
  first_ = ((centre - half_size_) / voxel_).array().floor().cast<int>();
  size_ = (2 * half_size_ / voxel_).array().round().cast<int>();
  words_ = (size_.x() + kWordBits - 1) / kWordBits;
  const auto words = row(0, size_.z());
  free_.assign(words, 0);
  occupied_.assign(words, 0);
  unfree_.resize(words);
  occupied_near_.resize(words);
  unfree_near_.resize(words);
}

void LocalWindow::fill(Bits& bits, const Vector3i& low, int side) const {
  const Vector3i from = low.cwiseMax(0);
  const Vector3i to = (low + Vector3i::Constant(side)).cwiseMin(size_);
  if ((from.array() >= to.array()).any()) return;
  for (int z = from.z(); z < to.z(); ++z) {
    for (int y = from.y(); y < to.y(); ++y) {
      const std::size_t start = row(y, z);
      for (int word = from.x() / kWordBits; word <= (to.x() - 1) / kWordBits; ++word) {
        const int left = std::max(from.x() - word * kWordBits, 0);
        const int right = std::min(to.x() - word * kWordBits, kWordBits);
        bits[start + static_cast<std::size_t>(word)] |= (kAll << left) & (kAll >> (kWordBits - right));
      }
    }
  }
}

void LocalWindow::take(const mapping::OccupancyMap& map) {
  const octomap::OcTree& tree = map.tree();
  const auto key = [&](const Vector3i& index) {
    const Vector3i k = (index.array() + kTreeCentre).cwiseMax(0).cwiseMin(2 * kTreeCentre - 1);
    return octomap::OcTreeKey(static_cast<octomap::key_type>(k.x()), static_cast<octomap::key_type>(k.y()),
                              static_cast<octomap::key_type>(k.z()));
  };
  const octomap::OcTreeKey low = key(first_);
  const octomap::OcTreeKey high = key(first_ + size_ - Vector3i::Ones());
  for (auto leaf = tree.begin_leafs_bbx(low, high), end = tree.end_leafs_bbx(); leaf != end; ++leaf) {
    const int side = 1 << (mapping::kTreeDepth - leaf.getDepth());
    const octomap::OcTreeKey& at = leaf.getKey();
    const Vector3i corner(at[0] & ~(side - 1), at[1] & ~(side - 1), at[2] & ~(side - 1));
    fill(tree.isNodeOccupied(*leaf) ? occupied_ : free_, corner - first_ - Vector3i::Constant(kTreeCentre),
         side);
  }
}

/// Voxels whose centre lies in the ball.
void LocalWindow::take(const KnownBall& ball) {
  const Vector3i low = ((ball.centre - Vector3d::Constant(ball.radius)) / voxel_).array().floor().cast<int>();
  const int side = static_cast<int>(2 * ball.radius / voxel_) + 2;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const Vector3i voxel = low + Vector3i(x, y, z);
        const Vector3d centre = voxel_ * (voxel.cast<double>() + Vector3d::Constant(0.5));
        if ((centre - ball.centre).norm() <= ball.radius) fill(free_, voxel - first_, 1);
      }
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
      for (int i = 1; i <= reach; ++i)
        bits |= (here << i) | (here >> i) | (left >> (kWordBits - i)) | (right << (kWordBits - i));
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

void LocalWindow::set(const mapping::OccupancyMap& map, const Vector3d& centre, double radius,
                      std::span<const KnownBall> known) {
  voxel_ = map.options().voxel;
  resize(centre);
  take(map);
  for (const KnownBall& ball : known) take(ball);
  for (std::size_t i = 0; i < free_.size(); ++i) unfree_[i] = ~free_[i] | occupied_[i];
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
