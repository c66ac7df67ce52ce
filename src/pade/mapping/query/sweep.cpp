// The first voxel that a ray or a moving ball meets.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/moving_ball.hpp"
#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kPiece = 8;              // of a segment that is searched at a time, voxels
constexpr double kHalfDiagonal = 0.8661;  // of a cube

/// Bits of the rows y and columns x of a word from first to last, of a tile that begins at `corner`.
std::uint64_t rectangle(const VoxelIndex& first, const VoxelIndex& last, int x, int y) {
  const int x0 = std::max(first[0] - x, 0);
  const int x1 = std::min(last[0] - x, 7);
  const int y0 = std::max(first[1] - y, 0);
  const int y1 = std::min(last[1] - y, 7);
  if (x0 > x1 || y0 > y1) return 0;
  const std::uint64_t row = (0xffULL >> (7 - x1 + x0)) << x0;
  const std::uint64_t rows = (~std::uint64_t{0} >> (8 * (7 - y1 + y0))) << (8 * y0);
  return (row * 0x0101010101010101ULL) & rows;
}

/// Calls `visit(corner of the tile, tile or null beyond the octree, z, bits)` for each word of voxels in the
/// bounds of a path that its tile does not rule out.
template <class Wanted, class Visit>
void for_each_word(const TileTree& tiles, const BallPath& path, const Wanted& wanted, const Visit& visit) {
  const AlignedBox3d bounds = path.bounds();
  const VoxelIndex first = voxel_beside(bounds.min(), tiles.voxel);
  const VoxelIndex last = voxel_beside(bounds.max(), tiles.voxel);
  const double reach = path.radius + kHalfDiagonal * kTileSide * tiles.voxel;
  static const Tile kBeyond;
  for (int z = first[2] >> 3; z <= last[2] >> 3; ++z) {
    for (int y = first[1] >> 3; y <= last[1] >> 3; ++y) {
      for (int x = first[0] >> 3; x <= last[0] >> 3; ++x) {
        const bool addressed = is_addressed({8 * x, 8 * y, 8 * z});
        const Tile& tile = addressed ? tiles.tile(x, y, z) : kBeyond;
        if (!wanted(tile)) continue;
        const VoxelIndex corner{8 * x, 8 * y, 8 * z};
        const Vector3d centre = corner_of({corner[0] + 4, corner[1] + 4, corner[2] + 4}, tiles.voxel);
        if (path.squared_distance(centre) >= reach * reach) continue;
        const std::uint64_t bits = rectangle(first, last, corner[0], corner[1]);
        for (int k = std::max(first[2] - corner[2], 0); k <= std::min(last[2] - corner[2], 7); ++k)
          visit(corner, tile, k, bits);
      }
    }
  }
}

/// Searches the pieces of a path in order.
class Sweep {
 public:
  Sweep(const TileTree& tiles, UnknownSpace unknown) : tiles_(tiles), unknown_(unknown) {}

  /// The first contact of the ball, length and share counted along this piece alone.
  std::optional<Hit> along(const BallPath& path) {
    best_ = std::numeric_limits<double>::infinity();
    const bool blocks = unknown_ == UnknownSpace::blocked;
    for_each_word(
        tiles_, path, [&](const Tile& tile) { return tile.any_occupied || (blocks && tile.any_unknown); },
        [&](const VoxelIndex& corner, const Tile& tile, int z, std::uint64_t bits) {
          const auto word = static_cast<std::size_t>(z);
          const std::uint64_t blocked = tile.occupied[word] | (blocks ? ~tile.known[word] : 0);
          for (bits &= blocked; bits != 0; bits &= bits - 1) {
            const int bit = std::countr_zero(bits);
            const bool occupied = (tile.occupied[word] >> bit & 1U) != 0;
            test(path, {corner[0] + (bit & 7), corner[1] + (bit >> 3), corner[2] + z},
                 occupied ? Occupancy::occupied : Occupancy::unknown);
          }
        });
    if (!std::isfinite(best_)) return std::nullopt;
    Hit hit;
    hit.length = best_;
    hit.place = path.at(best_);
    hit.voxel = box_of(voxel_, tiles_.voxel).center();
    hit.state = state_;
    return hit;
  }

 private:
  void test(const BallPath& path, const VoxelIndex& v, Occupancy state) {
    const AlignedBox3d box = box_of(v, tiles_.voxel);
    const Vector3d centre = box.center();
    const double reach = path.radius + kHalfDiagonal * tiles_.voxel;
    if (path.squared_distance(centre) >= reach * reach) return;
    if ((centre - path.start).dot(path.direction) - reach > best_) return;
    const std::optional<double> contact = path.first_contact(box);
    if (!contact || *contact > best_) return;
    const bool first_of_its_kind = state == Occupancy::occupied && state_ != Occupancy::occupied;
    if (*contact == best_ && !first_of_its_kind) return;
    best_ = *contact;
    voxel_ = v;
    state_ = state;
  }

  const TileTree& tiles_;
  UnknownSpace unknown_;
  double best_ = 0;
  VoxelIndex voxel_{};
  Occupancy state_ = Occupancy::unknown;
};

/// What of a segment lies in a box, as lengths along it; empty if nothing.
struct Range {
  double from = 0, to = 0;
};
std::optional<Range> clipped(const BallPath& path, const AlignedBox3d& box) {
  Range range{0, path.length};
  for (int axis = 0; axis < 3; ++axis) {
    const double d = path.direction[axis];
    const double p = path.start[axis];
    if (d == 0) {
      if (p < box.min()[axis] || p > box.max()[axis]) return std::nullopt;
      continue;
    }
    const double a = (box.min()[axis] - p) / d;
    const double b = (box.max()[axis] - p) / d;
    range.from = std::max(range.from, std::min(a, b));
    range.to = std::min(range.to, std::max(a, b));
  }
  if (range.from > range.to) return std::nullopt;
  return range;
}

BallPath segment_path(const Vector3d& from, const Vector3d& to, double radius) {
  BallPath path{from, Vector3d::Zero(), (to - from).norm(), radius};
  if (path.length > 0) path.direction = (to - from) / path.length;
  return path;
}

Hit blind(const Vector3d& place, double length, std::size_t segment) {
  Hit hit;
  hit.length = length;
  hit.segment = segment;
  hit.place = place;
  hit.voxel = place;
  hit.state = Occupancy::unknown;
  return hit;
}

}  // namespace

std::map<VoxelIndex, std::array<std::uint64_t, 8>> voxels_along(std::span<const Vector3d> path, double radius,
                                                                double voxel) {
  std::map<VoxelIndex, std::array<std::uint64_t, 8>> found;
  TileTree grid;
  grid.voxel = voxel;
  const auto add = [&](const Vector3d& from, const Vector3d& to) {
    if (!from.allFinite() || !to.allFinite()) return;
    const BallPath whole = segment_path(from, to, radius);
    const AlignedBox3d bounds = whole.bounds();
    const VoxelIndex first = voxel_beside(bounds.min(), voxel);
    const VoxelIndex last = voxel_beside(bounds.max(), voxel);
    VoxelIndex v{};
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2]) {
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1]) {
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0]) {
          if (!is_addressed(v) || !whole.first_contact(box_of(v, voxel))) continue;
          auto& bits = found[{v[0] >> 3, v[1] >> 3, v[2] >> 3}];
          bits[static_cast<std::size_t>(v[2] & 7)] |= std::uint64_t{1} << (8 * (v[1] & 7) + (v[0] & 7));
        }
      }
    }
  };
  if (path.size() == 1) add(path[0], path[0]);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) add(path[i], path[i + 1]);
  return found;
}

std::optional<Hit> MapView::sweep(std::span<const Vector3d> path, double radius, UnknownSpace unknown) const {
  if (path.empty()) return std::nullopt;
  if (!path[0].allFinite()) return blind(path[0], 0, 0);
  Sweep search(*tiles_, unknown);
  const double step = kPiece * tiles_->voxel;
  AlignedBox3d known = bounds();
  if (!known.isEmpty())
    known = AlignedBox3d(known.min().array() - radius - step, known.max().array() + radius + step);
  double before = 0;
  const std::size_t segments = std::max<std::size_t>(path.size() - 1, 1);
  for (std::size_t i = 0; i < segments; ++i) {
    const Vector3d& to = path[std::min(i + 1, path.size() - 1)];
    if (!to.allFinite()) return blind(path[i], before, i);
    const BallPath whole = segment_path(path[i], to, radius);
    Range range{0, whole.length};
    if (unknown == UnknownSpace::free) {
      const auto seen = known.isEmpty() ? std::nullopt : clipped(whole, known);
      range = seen.value_or(Range{0, -1});
    }
    // Pieces begin at the same places whatever has been clipped.
    for (double s = std::floor(range.from / step) * step; s <= range.to; s += step) {
      const BallPath piece{whole.at(s), whole.direction, std::min(step, whole.length - s), radius};
      if (std::optional<Hit> hit = search.along(piece)) {
        const double length = s + hit->length;
        hit->length = before + length;
        hit->segment = i;
        hit->share = whole.length > 0 ? std::min(length / whole.length, 1.0) : 0;
        return hit;
      }
      if (whole.length == 0) break;
    }
    before += whole.length;
  }
  return std::nullopt;
}

std::optional<Hit> MapView::ray(const Vector3d& origin, const Vector3d& direction, double reach,
                                UnknownSpace unknown) const {
  if (!origin.allFinite() || !direction.allFinite() || direction.squaredNorm() == 0)
    return blind(origin, 0, 0);
  const BallPath path{origin, direction.normalized(), reach, 0};
  Range range{0, reach};
  if (unknown == UnknownSpace::free) {
    const AlignedBox3d known = bounds();
    const auto seen = known.isEmpty() ? std::nullopt : clipped(path, known);
    if (!seen) return std::nullopt;
    range = *seen;
  }
  // Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987.
  const double voxel = tiles_->voxel;
  VoxelIndex v = voxel_beside(path.at(range.from), voxel);
  std::array<int, 3> step{};
  Vector3d next;
  Vector3d between;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double d = path.direction[axis];
    step[i] = d > 0 ? 1 : d < 0 ? -1 : 0;
    const double plane = voxel * (v[i] + (d > 0 ? 1 : 0) - kTreeCentre);
    next[axis] = step[i] == 0 ? std::numeric_limits<double>::infinity() : (plane - origin[axis]) / d;
    between[axis] = step[i] == 0 ? 0 : voxel / std::abs(d);
  }
  for (double s = range.from; s <= range.to;) {
    const Occupancy state = tiles_->at(v);
    if (state == Occupancy::occupied || (state == Occupancy::unknown && unknown == UnknownSpace::blocked)) {
      Hit hit;
      hit.length = s;
      hit.share = reach > 0 ? std::min(s / reach, 1.0) : 0;
      hit.place = path.at(s);
      hit.voxel = box_of(v, voxel).center();
      hit.state = state;
      return hit;
    }
    int axis = 0;
    next.minCoeff(&axis);
    s = std::max(s, next[axis]);
    v[static_cast<std::size_t>(axis)] += step[static_cast<std::size_t>(axis)];
    next[axis] += between[axis];
  }
  return std::nullopt;
}

}  // namespace pade::mapping
