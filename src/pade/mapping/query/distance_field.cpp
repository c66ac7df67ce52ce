#include "pade/mapping/query/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int kMostVoxels = 2000;

/// The lower envelope of the parabolas f(q) + (x - q)^2 over a row.
class Row {
 public:
  explicit Row(int size) : f_(static_cast<std::size_t>(size)), where_(f_.size()), from_(f_.size() + 1) {}
  std::int32_t& operator[](int i) { return f_[static_cast<std::size_t>(i)]; }
  /// @param most  what is as high or higher has no parabola
  template <class Out>
  void transform(std::int32_t most, const Out& out) {
    const int n = static_cast<int>(f_.size());
    int last = -1;
    for (int q = 0; q < n; ++q) {
      if ((*this)[q] >= most) continue;
      int begin = 0;
      for (; last >= 0; --last) {
        begin = first_below(where_[static_cast<std::size_t>(last)], q);
        if (begin > from_[static_cast<std::size_t>(last)]) break;
      }
      if (last < 0) begin = 0;
      if (begin >= n) continue;
      ++last;
      where_[static_cast<std::size_t>(last)] = q;
      from_[static_cast<std::size_t>(last)] = begin;
    }
    int k = 0;
    for (int x = 0; x < n; ++x) {
      if (last < 0) {
        out(x, most);
        continue;
      }
      while (k < last && from_[static_cast<std::size_t>(k) + 1] <= x) ++k;
      const int q = where_[static_cast<std::size_t>(k)];
      out(x, std::min(most, (*this)[q] + (x - q) * (x - q)));
    }
  }

 private:
  /// The first place from which on the parabola of q is below that of p < q.
  int first_below(int p, int q) {
    const std::int32_t above = (*this)[q] + q * q - ((*this)[p] + p * p);  // below 2^25
    return above < 0 ? 0 : above / (2 * (q - p)) + 1;
  }
  std::vector<std::int32_t> f_;
  std::vector<int> where_;
  std::vector<int> from_;
};

/// Whether the voxels from `v` to the end of its row in its tile block: bit 0 is `v`.
std::uint64_t blocked_in_row(const TileTree& tiles, const VoxelIndex& v, bool unknown_blocks) {
  if (!is_addressed(v)) return unknown_blocks ? 0xffU : 0;
  const Tile& tile = tiles.tile(v[0] >> 3, v[1] >> 3, v[2] >> 3);
  const Tile::Word& word = tile.words[static_cast<std::size_t>(v[2] & 7)];
  const std::uint64_t blocked = word.occupied | (unknown_blocks ? ~word.known : 0);
  return blocked >> (8 * (v[1] & 7) + (v[0] & 7));
}

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
    field.size_[axis] = std::min(last[i] - first[i] + 1, kMostVoxels);
  }
  field.first_ = first;
  field.corner_ = corner_of(first, field.voxel_);
  const double voxels = std::min(most / field.voxel_, 2.0 * kMostVoxels);
  field.most_ = static_cast<std::int32_t>(std::ceil(voxels * voxels));
  field.mark(view, unknown);
  for (int axis = 1; axis < 3; ++axis) field.transform(axis);
  return field;
}

void DistanceField::mark(const MapView& view, UnknownSpace unknown) {
  const TileTree& tiles = view.tiles();
  const bool blocks = unknown == UnknownSpace::blocked;
  squared_.assign(static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
                      static_cast<std::size_t>(size_.z()),
                  most_);
  std::int32_t* row = squared_.data();
  for (int z = 0; z < size_.z(); ++z) {
    for (int y = 0; y < size_.y(); ++y, row += size_.x()) {
      for (int x = 0; x < size_.x();) {
        const VoxelIndex v{first_[0] + x, first_[1] + y, first_[2] + z};
        const int in_tile = std::min(kTileSide - (v[0] & 7), size_.x() - x);  // of the row
        const std::uint64_t bits = blocked_in_row(tiles, v, blocks);
        for (int k = 0; k < in_tile; ++k)
          if ((bits >> k & 1U) != 0) row[x + k] = 0;
        x += in_tile;
      }
      along_x(row);
    }
  }
}

/// The first pass: the distance along the row alone.
void DistanceField::along_x(std::int32_t* row) const {
  const auto pass = [&](int from, int to, int step) {
    int distance = 2 * kMostVoxels;
    for (int x = from; x != to; x += step) {
      distance = row[x] == 0 ? 0 : std::min(distance + 1, 2 * kMostVoxels);
      row[x] = std::min(row[x], distance * distance);
    }
  };
  pass(0, size_.x(), 1);
  pass(size_.x() - 1, -1, -1);
}

void DistanceField::transform(int axis) {
  const std::array<std::ptrdiff_t, 3> strides{1, size_.x(), std::ptrdiff_t{size_.x()} * size_.y()};
  const int other = axis == 2 ? 1 : 2;  // beside x
  const std::ptrdiff_t stride = strides[static_cast<std::size_t>(axis)];
  Row row(size_[axis]);
  for (int j = 0; j < size_[other]; ++j) {
    for (int x = 0; x < size_.x(); ++x) {
      std::int32_t* start = squared_.data() + x + j * strides[static_cast<std::size_t>(other)];
      for (int k = 0; k < size_[axis]; ++k) row[k] = start[k * stride];
      row.transform(most_, [&](int k, std::int32_t value) { start[k * stride] = value; });
    }
  }
}

double DistanceField::at(const Vector3i& v) const {
  const std::size_t i = static_cast<std::size_t>(v.x()) +
                        static_cast<std::size_t>(size_.x()) *
                            (static_cast<std::size_t>(v.y()) +
                             static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z()));
  return voxel_ * std::sqrt(static_cast<double>(squared_[i]));
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
