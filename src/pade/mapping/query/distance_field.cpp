#include "pade/mapping/query/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "pade/mapping/query/distance_kernels.hpp"
#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// The bits of the rows along x of a box: those of the voxels that block.
struct Rows {
  int row_bytes = 0;
  int first_bit = 0;  // of each row
  std::vector<std::uint8_t> bits;
};

/// Takes them from the tiles.
class RowsOfBox {
 public:
  RowsOfBox(const VoxelIndex& first, const Eigen::Vector3i& size, int stride) : first_(first), size_(size) {
    rows_.row_bytes = stride / 8 + 16;
    rows_.first_bit = first[0] & 7;
    rows_.bits.assign(static_cast<std::size_t>(rows_.row_bytes) * static_cast<std::size_t>(size.y()) *
                          static_cast<std::size_t>(size.z()),
                      0);
  }
  Rows read(const TileTree& tiles, bool unknown_blocks) {
    static const Tile beyond;
    VoxelIndex last{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      last[axis] = first_[axis] + size_[static_cast<int>(axis)] - 1;
    for (int z = first_[2] >> 3; z <= last[2] >> 3; ++z)
      for (int y = first_[1] >> 3; y <= last[1] >> 3; ++y)
        for (int x = first_[0] >> 3; x <= last[0] >> 3; ++x) {
          const Tile& tile = is_addressed({8 * x, 8 * y, 8 * z}) ? tiles.tile(x, y, z) : beyond;
          if (tile.any_occupied || (unknown_blocks && tile.any_unknown)) add(tile, {x, y, z}, unknown_blocks);
        }
    // Of the last tile of each row only what lies in the box counts.
    const int end = rows_.first_bit + size_.x();
    if ((end & 7) != 0)
      for (std::size_t at = static_cast<std::size_t>(end / 8); at < rows_.bits.size();
           at += static_cast<std::size_t>(rows_.row_bytes))
        rows_.bits[at] &= static_cast<std::uint8_t>((1 << (end & 7)) - 1);
    return std::move(rows_);
  }

 private:
  void add(const Tile& tile, const VoxelIndex& place, bool unknown_blocks) {
    const int x = place[0] - (first_[0] >> 3);
    const int y = 8 * place[1] - first_[1];
    const int z = 8 * place[2] - first_[2];
    for (int k = std::max(-z, 0); k < std::min(kTileSide, size_.z() - z); ++k) {
      const Tile::Word& word = tile.words[static_cast<std::size_t>(k)];
      const std::uint64_t blocked = word.occupied | (unknown_blocks ? ~word.known : 0);
      if (blocked == 0) continue;
      const std::size_t row = static_cast<std::size_t>(z + k) * static_cast<std::size_t>(size_.y());
      for (int j = std::max(-y, 0); j < std::min(kTileSide, size_.y() - y); ++j)
        rows_.bits[(row + static_cast<std::size_t>(y + j)) * static_cast<std::size_t>(rows_.row_bytes) +
                   static_cast<std::size_t>(x)] = static_cast<std::uint8_t>(blocked >> (8 * j) & 0xffU);
    }
  }
  VoxelIndex first_;
  Eigen::Vector3i size_;
  Rows rows_;
};

}  // namespace

DistanceField DistanceField::of(const MapView& view, const Eigen::AlignedBox3d& box, UnknownSpace unknown,
                                double most) {
  DistanceField field;
  field.voxel_ = view.voxel();
  if (box.isEmpty() || !box.min().allFinite() || !box.max().allFinite() || !(most > 0)) return field;
  const VoxelIndex first = voxel_beside(box.min(), field.voxel_);
  const VoxelIndex last = voxel_beside(box.max(), field.voxel_);
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    field.size_[axis] = std::min(last[i] - first[i] + 1, kMostDistanceRows);
  }
  field.corner_ = corner_of(first, field.voxel_);
  const double voxels = std::min(most / field.voxel_, 2.0 * kMostDistanceRows);
  const auto square = static_cast<std::int32_t>(std::ceil(voxels * voxels));
  field.stride_ = (field.size_.x() + kDistanceLanes - 1) / kDistanceLanes * kDistanceLanes;
  const Rows rows =
      RowsOfBox(first, field.size_, field.stride_).read(view.tiles(), unknown == UnknownSpace::blocked);
  const auto fill = [&](auto& squared, auto* kernel) {
    using Value = typename std::remove_reference_t<decltype(squared)>::value_type;
    squared.resize(static_cast<std::size_t>(field.stride_) * static_cast<std::size_t>(field.size_.y()) *
                   static_cast<std::size_t>(field.size_.z()));
    std::vector<Value> scratch(
        static_cast<std::size_t>(distance_scratch(field.size_.maxCoeff(), field.stride_)));
    const DistanceBox<Value> work{field.size_.x(),  field.size_.y(), field.size_.z(), field.stride_,
                                  rows.bits.data(), rows.row_bytes,  rows.first_bit,  square,
                                  squared.data(),   scratch.data()};
    kernel(work);
  };
  if (square <= kMostOf16Bits) {
    fill(field.near_, PADE_DISPATCH(near_distances, simd::best()));
  } else {
    fill(field.far_, PADE_DISPATCH(far_distances, simd::best()));
  }
  return field;
}

double DistanceField::at(const Vector3i& v) const {
  const std::size_t row =
      static_cast<std::size_t>(v.y()) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z());
  const std::size_t i = static_cast<std::size_t>(v.x()) + static_cast<std::size_t>(stride_) * row;
  return voxel_ * std::sqrt(static_cast<double>(near_.empty() ? far_[i] : near_[i]));
}

Vector3d DistanceField::centre(const Vector3i& voxel) const {
  return corner_ + voxel_ * (voxel.cast<double>().array() + 0.5).matrix();
}

bool DistanceField::cell_at(const Vector3d& point, Cell& cell) const {
  const Vector3d place = (point - corner_) / voxel_;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(place[axis] >= 0 && place[axis] <= size_[axis]) || size_[axis] == 0) return false;
  }
  Vector3i low;
  Vector3i high;
  for (int axis = 0; axis < 3; ++axis) {
    const double from_centre = std::clamp(place[axis] - 0.5, 0.0, static_cast<double>(size_[axis] - 1));
    low[axis] = std::min(static_cast<int>(from_centre), std::max(size_[axis] - 2, 0));
    high[axis] = std::min(low[axis] + 1, size_[axis] - 1);
    cell.share[axis] = from_centre - low[axis];
  }
  for (unsigned i = 0; i < 8; ++i) {
    cell.distance[i] = at({(i & 1U) != 0 ? high.x() : low.x(), (i & 2U) != 0 ? high.y() : low.y(),
                           (i & 4U) != 0 ? high.z() : low.z()});
  }
  return true;
}

double DistanceField::distance(const Vector3d& point) const {
  Cell cell;
  if (!cell_at(point, cell)) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (unsigned i = 0; i < 8; ++i) {
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis)
      weight *= (i >> axis & 1U) != 0 ? cell.share[axis] : 1 - cell.share[axis];
    sum += weight * cell.distance[i];
  }
  return sum;
}

Vector3d DistanceField::gradient(const Vector3d& point) const {
  Cell cell;
  if (!cell_at(point, cell)) return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  Vector3d sum = Vector3d::Zero();
  for (unsigned i = 0; i < 8; ++i) {
    for (int along = 0; along < 3; ++along) {
      double weight = (i >> along & 1U) != 0 ? 1 : -1;
      for (int axis = 0; axis < 3; ++axis) {
        if (axis != along) weight *= (i >> axis & 1U) != 0 ? cell.share[axis] : 1 - cell.share[axis];
      }
      sum[along] += weight * cell.distance[i] / voxel_;
    }
  }
  return sum;
}

}  // namespace pade::mapping
