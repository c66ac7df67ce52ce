#include "pade/mapping/query/surroundings.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;

constexpr double kSectorAngle = 2 * std::numbers::pi / kSectors;

int sector_of(double angle) { return static_cast<int>(std::floor(angle / kSectorAngle + 0.5)); }

/// The nearest voxel so far, sector by sector.
class Nearest {
 public:
  Nearest(const Vector3d& place, double reach, double voxel) : place_(place), reach_(reach), voxel_(voxel) {
    distances_.fill(std::numeric_limits<double>::infinity());
  }
  /// A square column of `side` voxels whose lower corner is at `v`: whether it can be nearer than what is
  /// known.
  [[nodiscard]] bool can_matter(const VoxelIndex& v, int side) const {
    const Square square(*this, v, side);
    if (square.distance > reach_) return false;
    bool matters = false;
    square.for_each_sector([&](std::size_t i) { matters = matters || square.distance < distances_[i]; });
    return matters;
  }
  void add(const VoxelIndex& v) {
    const Square square(*this, v, 1);
    if (square.distance > reach_) return;
    square.for_each_sector([&](std::size_t i) { distances_[i] = std::min(distances_[i], square.distance); });
  }
  [[nodiscard]] const std::array<double, kSectors>& distances() const { return distances_; }

 private:
  /// Seen from the place: nearest point and range of angles.
  struct Square {
    Square(const Nearest& from, const VoxelIndex& v, int side) {
      const double x0 = (v[0] - kTreeCentre) * from.voxel_ - from.place_.x();
      const double y0 = (v[1] - kTreeCentre) * from.voxel_ - from.place_.y();
      const double x1 = x0 + side * from.voxel_;
      const double y1 = y0 + side * from.voxel_;
      const double x = std::clamp(0.0, x0, x1);
      const double y = std::clamp(0.0, y0, y1);
      distance = std::hypot(x, y);
      if (distance == 0) return;  // all around
      const double middle = std::atan2((y0 + y1) / 2, (x0 + x1) / 2);
      low = high = middle;
      for (const auto& [cx, cy] : {std::pair{x0, y0}, {x0, y1}, {x1, y0}, {x1, y1}}) {
        const double angle = middle + std::remainder(std::atan2(cy, cx) - middle, 2 * std::numbers::pi);
        low = std::min(low, angle);
        high = std::max(high, angle);
      }
    }
    template <class Visit>
    void for_each_sector(const Visit& visit) const {
      const int n = static_cast<int>(kSectors);
      const int first = distance == 0 ? 0 : sector_of(low);
      const int last = distance == 0 ? n - 1 : sector_of(high);
      for (int i = first; i <= last; ++i) visit(static_cast<std::size_t>((i % n + n) % n));
    }
    double distance = 0;
    double low = 0, high = 0;
  };

  Vector3d place_;
  double reach_;
  double voxel_;
  std::array<double, kSectors> distances_{};
};

/// Voxels of a tile that block, seen from above: those of the words from `first` to `last` together.
std::uint64_t from_above(const Tile& tile, int first, int last, bool unknown_blocks) {
  std::uint64_t bits = 0;
  for (int z = first; z <= last; ++z) {
    const Tile::Word& word = tile.words[static_cast<std::size_t>(z)];
    bits |= word.occupied | (unknown_blocks ? ~word.known : 0);
  }
  return bits;
}

/// Where a voxel lies, as one number; it may lie one beside what can be addressed.
std::uint64_t place_of(const VoxelIndex& v) {
  const auto part = [](int i) { return static_cast<std::uint64_t>(i + 2); };
  return part(v[0]) | part(v[1]) << 20U | part(v[2]) << 40U;
}

/// Voxels that are not in a group yet: the place of each, and where it stands in the list.
using Ungrouped = std::unordered_map<std::uint64_t, std::size_t>;

/// Moves what touches a voxel from `left` to `reached`.
void take_neighbours(const VoxelIndex& v, Ungrouped& left, std::vector<std::size_t>& reached) {
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const auto beside = left.find(place_of({v[0] + x, v[1] + y, v[2] + z}));
        if (beside == left.end()) continue;
        reached.push_back(beside->second);
        left.erase(beside);
      }
    }
  }
}

}  // namespace

std::array<double, kSectors> sectors(const MapView& view, const Vector3d& place, double reach, double below,
                                     double above, UnknownSpace unknown) {
  const TileTree& tiles = view.tiles();
  const bool blocks = unknown == UnknownSpace::blocked;
  Nearest nearest(place, reach, tiles.voxel);
  const bool is_question =
      place.allFinite() && std::isfinite(reach) && !std::isnan(below) && !std::isnan(above);
  VoxelIndex here;
  if (!is_question || (blocks && !voxel_at(place, tiles.per_voxel, here))) return {};
  if (!(reach > 0)) return nearest.distances();
  const VoxelIndex low = voxel_beside(place - Vector3d(reach, reach, below), tiles.voxel);
  const VoxelIndex high = voxel_beside(place + Vector3d(reach, reach, above), tiles.voxel);
  static const Tile kBeyond;
  struct Column {
    int ring, x, y;
  };
  const int cx = (low[0] + high[0]) / 2 >> 3;
  const int cy = (low[1] + high[1]) / 2 >> 3;
  std::vector<Column> columns;
  for (int y = low[1] >> 3; y <= high[1] >> 3; ++y)
    for (int x = low[0] >> 3; x <= high[0] >> 3; ++x)
      columns.push_back({std::max(std::abs(x - cx), std::abs(y - cy)), x, y});
  std::stable_sort(columns.begin(), columns.end(),
                   [](const Column& a, const Column& b) { return a.ring < b.ring; });
  for (const Column& column : columns) {
    const VoxelIndex corner{8 * column.x, 8 * column.y, 0};
    std::uint64_t bits = 0;
    for (int z = low[2] >> 3; z <= high[2] >> 3; ++z) {
      const bool addressed = is_addressed({corner[0], corner[1], 8 * z});
      const Tile& tile = addressed ? tiles.tile(column.x, column.y, z) : kBeyond;
      if (!tile.any_occupied && !(blocks && tile.any_unknown)) continue;
      bits |= from_above(tile, std::max(low[2] - 8 * z, 0), std::min(high[2] - 8 * z, 7), blocks);
    }
    if (bits == 0 || !nearest.can_matter(corner, 8)) continue;
    for (; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      nearest.add({corner[0] + (bit & 7), corner[1] + (bit >> 3), 0});
    }
  }
  return nearest.distances();
}

std::vector<Vector3d> frontiers(const MapView& view, const Eigen::AlignedBox3d& box) {
  std::vector<Vector3d> found;
  const TileTree& tiles = view.tiles();
  if (!is_box(box)) return found;
  const Eigen::AlignedBox3d within = box.intersection(view.bounds());
  if (within.isEmpty()) return found;
  const VoxelIndex first = voxel_beside(within.min(), tiles.voxel);
  const VoxelIndex last = voxel_beside(within.max(), tiles.voxel);
  const auto is_unknown = [&](int x, int y, int z) { return tiles.at({x, y, z}) == Occupancy::unknown; };
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        if (tiles.at({x, y, z}) != Occupancy::free) continue;
        if (is_unknown(x - 1, y, z) || is_unknown(x + 1, y, z) || is_unknown(x, y - 1, z) ||
            is_unknown(x, y + 1, z) || is_unknown(x, y, z - 1) || is_unknown(x, y, z + 1)) {
          found.push_back(box_of({x, y, z}, tiles.voxel).center());
        }
      }
    }
  }
  return found;
}

std::vector<FrontierGroup> frontier_groups(std::span<const Vector3d> found, double voxel) {
  std::vector<FrontierGroup> groups;
  Ungrouped left;
  for (std::size_t i = 0; i < found.size(); ++i) left.emplace(place_of(voxel_beside(found[i], voxel)), i);
  std::vector<std::size_t> reached;
  for (const Vector3d& first : found) {
    const auto seed = left.find(place_of(voxel_beside(first, voxel)));
    if (seed == left.end()) continue;
    reached.assign(1, seed->second);
    left.erase(seed);
    FrontierGroup group{0, Vector3d::Zero(), {}};
    while (!reached.empty()) {
      const Vector3d centre = found[reached.back()];
      reached.pop_back();
      ++group.voxels;
      group.centre += centre;
      group.bounds.extend(Vector3d(centre.array() - 0.5 * voxel));
      group.bounds.extend(Vector3d(centre.array() + 0.5 * voxel));
      take_neighbours(voxel_beside(centre, voxel), left, reached);
    }
    group.centre /= static_cast<double>(group.voxels);
    groups.push_back(group);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const FrontierGroup& a, const FrontierGroup& b) { return a.voxels > b.voxels; });
  return groups;
}

}  // namespace pade::mapping
