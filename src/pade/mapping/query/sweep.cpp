// The first voxel that a ray or a moving ball meets.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/moving_ball.hpp"
#include "pade/mapping/query/sweep_kernels.hpp"
#include "pade/mapping/query/tile_tree.hpp"
#include "pade/mapping/query/voxel_grid.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kPiece = 8;              // of a segment that is searched at a time, voxels
constexpr double kHalfDiagonal = 0.8661;  // of a cube
constexpr double kRoundedLength = 0.01;   // voxels: more than lengths are rounded by

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

/// Voxels of a tile: the words from `first` to `last`, of each the bits.
struct PartOfTile {
  VoxelIndex corner;
  int first = 0, last = 0;
  std::uint64_t bits = 0;
};

/// From first to last, or from last to first where the path leads that way: what is met early comes early.
template <class Visit>
void in_order(double direction, int first, int last, const Visit& visit) {
  if (direction >= 0) {
    for (int i = first; i <= last; ++i) visit(i);
  } else {
    for (int i = last; i >= first; --i) visit(i);
  }
}

/// Calls `visit` for the tiles that a ball may touch on its path.
template <class Visit>
void for_each_tile(double voxel, const BallPath& path, const Visit& visit) {
  const AlignedBox3d bounds = path.bounds();
  const VoxelIndex first = voxel_beside(bounds.min(), voxel);
  const VoxelIndex last = voxel_beside(bounds.max(), voxel);
  const double reach = path.radius + kHalfDiagonal * kTileSide * voxel;
  const Vector3d& d = path.direction;
  in_order(d.z(), first[2] >> 3, last[2] >> 3, [&](int z) {
    in_order(d.y(), first[1] >> 3, last[1] >> 3, [&](int y) {
      in_order(d.x(), first[0] >> 3, last[0] >> 3, [&](int x) {
        const VoxelIndex corner{8 * x, 8 * y, 8 * z};
        const Vector3d centre = corner_of({corner[0] + 4, corner[1] + 4, corner[2] + 4}, voxel);
        if (path.squared_distance(centre) >= reach * reach) return;
        visit(PartOfTile{corner, std::max(first[2] - corner[2], 0), std::min(last[2] - corner[2], 7),
                         rectangle(first, last, corner[0], corner[1])});
      });
    });
  });
}

/// Searches the pieces of a path in order.
class Sweep {
 public:
  Sweep(const TileTree& tiles, UnknownSpace unknown) : tiles_(tiles), unknown_(unknown) {}

  /// The first contact of the ball, length and share counted along this piece alone.
  std::optional<Hit> along(const BallPath& path) {
    best_ = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) ball_.direction[axis] = static_cast<float>(path.direction[axis]);
    ball_.length = static_cast<float>(path.length);
    ball_.radius = static_cast<float>(path.radius);
    ball_.voxel = static_cast<float>(tiles_.voxel);
    for_each_tile(tiles_.voxel, path, [&](const PartOfTile& part) { search(path, part); });
    if (!std::isfinite(best_)) return std::nullopt;
    Hit hit;
    hit.length = best_;
    hit.place = path.at(best_);
    hit.voxel = box_of(voxel_, tiles_.voxel).center();
    hit.state = state_;
    return hit;
  }

 private:
  void search(const BallPath& path, const PartOfTile& part) {
    static const Tile beyond;
    const VoxelIndex& corner = part.corner;
    const bool blocks = unknown_ == UnknownSpace::blocked;
    const Tile& tile =
        is_addressed(corner) ? tiles_.tile(corner[0] >> 3, corner[1] >> 3, corner[2] >> 3) : beyond;
    if (!tile.any_occupied && !(blocks && tile.any_unknown)) return;
    const double side = tiles_.voxel;
    bool is_placed = false;
    in_order(path.direction.z(), part.first, part.last, [&](int z) {
      const Tile::Word& word = tile.words[static_cast<std::size_t>(z)];
      const std::uint64_t bits = part.bits & (word.occupied | (blocks ? ~word.known : 0));
      if (bits == 0) return;
      if (!is_placed) {
        const Vector3d to = corner_of(corner, side) + Vector3d::Constant(0.5 * side) - path.start;
        for (int axis = 0; axis < 3; ++axis) ball_.first[axis] = static_cast<float>(to[axis]);
        is_placed = true;
      }
      search_word(path, {corner[0], corner[1], corner[2] + z}, bits, word.occupied);
    });
  }
  /// @param first  of the word's voxels. @param bits  those that block
  void search_word(const BallPath& path, const VoxelIndex& first, std::uint64_t bits,
                   std::uint64_t occupied) {
    const int z = first[2] & 7;
    double best = best_;
    for (bits = near_(ball_, z, bits); bits != 0;) {
      const int y = path.direction.y() >= 0 ? std::countr_zero(bits) / 8 : 7 - std::countl_zero(bits) / 8;
      const auto row = static_cast<std::uint8_t>(bits >> (8 * y));
      const int x = path.direction.x() >= 0 ? std::countr_zero(row) : 7 - std::countl_zero(row);
      const std::uint64_t bit = std::uint64_t{1} << (8 * y + x);
      bits &= ~bit;
      test(path, {first[0] + x, first[1] + y, first[2]},
           (occupied & bit) != 0 ? Occupancy::occupied : Occupancy::unknown);
      if (best_ >= best) continue;
      best = best_;  // what is met later does not count any more
      ball_.length = static_cast<float>(std::min(path.length, best + kRoundedLength * tiles_.voxel));
      bits = near_(ball_, z, bits);
    }
  }
  void test(const BallPath& path, const VoxelIndex& v, Occupancy state) {
    const AlignedBox3d box = box_of(v, tiles_.voxel);
    const Vector3d to = box.center() - path.start;
    const double reach = path.radius + kHalfDiagonal * tiles_.voxel;
    const double along = to.dot(path.direction);
    const double half = reach * reach - (to.squaredNorm() - along * along);  // of the chord, squared
    const double outside = std::max({-along, along - path.length, 0.0});  // before the start or past the end
    if (half <= outside * outside) return;
    const double beyond = along - best_;
    if (beyond > 0 && beyond * beyond > half) return;  // whatever touches it, touches it later
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
  decltype(&baseline::voxels_near_ball) near_ = PADE_DISPATCH(voxels_near_ball, simd::best());
  BallInTile ball_{};
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

/// Of length 1. Squares of very long and very short vectors are none.
Vector3d unit(const Vector3d& direction) {
  if (std::isnormal(direction.squaredNorm())) return direction.normalized();
  return (direction / direction.cwiseAbs().maxCoeff()).normalized();
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
  if (!is_radius(radius)) return found;
  const double step = kPiece * voxel;
  const double end = kTreeCentre * voxel + radius;
  const AlignedBox3d near(Vector3d::Constant(-end), Vector3d::Constant(end));  // what can be addressed
  const auto add = [&](const BallPath& piece) {
    for_each_tile(voxel, piece, [&](const PartOfTile& part) {
      const VoxelIndex& corner = part.corner;
      for (int z = part.first; z <= part.last && is_addressed(corner); ++z) {
        for (std::uint64_t bits = part.bits; bits != 0; bits &= bits - 1) {
          const int bit = std::countr_zero(bits);
          const VoxelIndex v{corner[0] + (bit & 7), corner[1] + (bit >> 3), corner[2] + z};
          if (!piece.first_contact(box_of(v, voxel))) continue;
          found[{v[0] >> 3, v[1] >> 3, v[2] >> 3}][static_cast<std::size_t>(z)] |= std::uint64_t{1} << bit;
        }
      }
    });
  };
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Vector3d& to = path[std::min(i + 1, path.size() - 1)];
    if (!path[i].allFinite() || !to.allFinite()) continue;
    const BallPath whole = segment_path(path[i], to, radius);
    if (!std::isfinite(whole.length)) continue;
    const Range range = clipped(whole, near).value_or(Range{0, -1});
    for (double s = std::floor(range.from / step) * step; s <= range.to; s += step)
      add({whole.at(s), whole.direction, std::min(step, whole.length - s), radius});
  }
  return found;
}

namespace {

/// Where a segment has to be searched: `box` is where there can be something to meet.
Range to_search(const BallPath& segment, const AlignedBox3d& box) {
  if (box.isEmpty()) return {0, -1};
  return clipped(segment, box).value_or(Range{0, -1});
}

/// What the octree can address, without the places from where a ball reaches beyond.
AlignedBox3d addressed(double voxel, double radius) {
  const double end = kTreeCentre * voxel - radius;
  return {Vector3d::Constant(-end), Vector3d::Constant(end)};
}

}  // namespace

std::optional<Hit> MapView::sweep(std::span<const Vector3d> path, double radius, UnknownSpace unknown) const {
  if (path.empty()) return std::nullopt;
  if (!path[0].allFinite() || !is_radius(radius)) return blind(path[0], 0, 0);
  Sweep search(*tiles_, unknown);
  const bool blocks = unknown == UnknownSpace::blocked;
  const double step = kPiece * tiles_->voxel;
  AlignedBox3d box = blocks ? addressed(tiles_->voxel, radius) : bounds();
  if (!blocks && !box.isEmpty())
    box = AlignedBox3d(box.min().array() - radius - step, box.max().array() + radius + step);
  double before = 0;
  const std::size_t segments = std::max<std::size_t>(path.size() - 1, 1);
  for (std::size_t i = 0; i < segments; ++i) {
    const Vector3d& to = path[std::min(i + 1, path.size() - 1)];
    if (!to.allFinite()) return blind(path[i], before, i);
    const BallPath whole = segment_path(path[i], to, radius);
    if (!std::isfinite(whole.length)) return blind(path[i], before, i);
    const Range range = to_search(whole, box);
    if (blocks && range.from != 0) return blind(path[i], before, i);
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
    if (blocks && range.to < whole.length)
      return blind(whole.at(std::max(range.to, 0.0)), before + std::max(range.to, 0.0), i);
    before += whole.length;
  }
  return std::nullopt;
}

std::optional<Hit> MapView::ray(const Vector3d& origin, const Vector3d& direction, double reach,
                                UnknownSpace unknown) const {
  if (!origin.allFinite() || !direction.allFinite() || direction.isZero(0) || std::isnan(reach))
    return blind(origin, 0, 0);
  const BallPath path{origin, unit(direction), reach, 0};
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
