// Triangles made ready to be drawn, for raster_kernels.cpp alone: compiled once per instruction set.
//
// In the camera's frame, with the camera at the origin, pixels are rays d = (x, y, 1). A ray passes an edge
// from p to q on the side that
//   e(d) = d . N,   N = (q - p) x (q + p) = 2 q x p
// says, linear in x and y. Written so, N is the exact negative of the neighbour's, who has the edge from q to
// p, and no ray falls between the two; and it loses nothing where p and q are close together far away. With
// n = (b - a) x (c - a) the inverse depth at d is w = (n . d) / (n . a), linear too. No clipping is needed:
// what lies behind the camera has w <= 0 (Olano and Greer, Triangle scan conversion using 2D homogeneous
// coordinates, 1997).
#pragma once

#include "pade/core/compute/vec.hpp"
#include "pade/simulation/render/raster/raster_kernels.hpp"

namespace pade::simulation::PADE_ISA {

using simd::PADE_ISA::abs;
using simd::PADE_ISA::bits;
using simd::PADE_ISA::gather;
using simd::PADE_ISA::I;
using simd::PADE_ISA::kLanes;
using simd::PADE_ISA::load;
using simd::PADE_ISA::max;
using simd::PADE_ISA::min;
using simd::PADE_ISA::set;
using simd::PADE_ISA::store;
using simd::PADE_ISA::to_float;
using simd::PADE_ISA::truncate;
using simd::PADE_ISA::V;

constexpr int kParts = raster_lanes / kLanes;  // vectors per block and per packet

struct Vec3 {
  V x, y, z;
};
PADE_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
PADE_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
PADE_INLINE Vec3 operator*(V s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
PADE_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
PADE_INLINE V dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Triangles of a vector ready to draw; `function` are the three edges and the inverse depth over (x, y).
struct Setup {
  static constexpr int kInverseDepth = 3;
  alignas(64) float function[4][3][kLanes];
  alignas(64) float nearest[kLanes];                               ///< largest inverse depth of a corner
  alignas(64) float farthest[kLanes];                              ///< smallest
  alignas(64) int x0[kLanes], x1[kLanes], y0[kLanes], y1[kLanes];  ///< blocks
  unsigned drawn;                                                  ///< bit per lane
};

/// The corners in the camera's frame.
PADE_INLINE void to_camera(const float (&r)[9], const float (&origin)[3], const TrianglePacket& packet,
                           int first_lane, Vec3 (&p)[3]) {
  for (int i = 0; i < 3; ++i) {
    const Vec3 w = {load(packet.corner[i][0] + first_lane) - origin[0],
                    load(packet.corner[i][1] + first_lane) - origin[1],
                    load(packet.corner[i][2] + first_lane) - origin[2]};
    p[i] = {r[0] * w.x + r[1] * w.y + r[2] * w.z, r[3] * w.x + r[4] * w.y + r[5] * w.z,
            r[6] * w.x + r[7] * w.y + r[8] * w.z};
  }
}

/// What of a tile triangles may cover.
struct Extent {
  I in_front;        ///< all of it, and not so near to the camera's plane that rounding shows
  I visible;         ///< at all
  I x0, x1, y0, y1;  ///< blocks
  V nearest;         ///< largest inverse depth
  V farthest_z;
};

PADE_INLINE I all_in_front(const Vec3 (&p)[3], V nearest_z) {
  constexpr float kNear = 1e-4F;   // metres
  constexpr float kSteep = 1e-3F;  // z per x and y
  I in_front = nearest_z > kNear;
  for (const Vec3& corner : p)
    in_front &= (corner.z > kSteep * corner.x) & (corner.z > -kSteep * corner.x) &
                (corner.z > kSteep * corner.y) & (corner.z > -kSteep * corner.y);
  return in_front;
}

/// First and last pixel centre between `low` and `high` of the pixels [first, last], counted from the first
/// (not negative: truncation is the floor, and what is left after it says whether the ceiling is one more).
PADE_INLINE void centres_within(V low, V high, V first, V last, I& from, I& to) {
  low = min(max(low, first), last + 1.0F) - first;
  high = min(max(high, first - 1.0F), last) - first;
  const I whole = truncate(low);
  from = whole - (to_float(whole) < low);
  to = truncate(high + 1.0F) - 1;  // high may be -1
}

/// Pixels that can be inside. A triangle that reaches behind the camera may be anywhere.
PADE_INLINE Extent extent_of(const RasterView& view, const Vec3 (&p)[3], const RasterTile& tile) {
  constexpr float kMargin = 0.25F;  // pixels, some four times what rounding takes
  Extent out{};
  const V nearest_z = min(p[0].z, min(p[1].z, p[2].z));
  out.farthest_z = max(p[0].z, max(p[1].z, p[2].z));
  out.in_front = all_in_front(p, nearest_z);
  V u[3], v[3];
  for (int i = 0; i < 3; ++i) {
    const V inverse = 1.0F / p[i].z;
    u[i] = view.fx * (p[i].x * inverse) + view.cx;
    v[i] = view.fy * (p[i].y * inverse) + view.cy;
  }
  const V left = set(static_cast<float>(raster_side * tile.left));
  const V top = set(static_cast<float>(raster_side * tile.top));
  const V right = left + static_cast<float>(raster_side * tile.columns - 1);
  const V bottom = top + static_cast<float>(raster_side * tile.rows - 1);
  I x0, x1, y0, y1;
  centres_within(out.in_front ? min(u[0], min(u[1], u[2])) - kMargin : left,
                 out.in_front ? max(u[0], max(u[1], u[2])) + kMargin : right, left, right, x0, x1);
  centres_within(out.in_front ? min(v[0], min(v[1], v[2])) - kMargin : top,
                 out.in_front ? max(v[0], max(v[1], v[2])) + kMargin : bottom, top, bottom, y0, y1);
  out.x0 = x0 >> 2;
  out.x1 = x1 >> 2;
  out.y0 = y0 >> 2;
  out.y1 = y1 >> 2;
  out.nearest = out.in_front ? 1.0F / nearest_z : set(__builtin_inff());
  out.visible = (x0 <= x1) & (y0 <= y1) & (out.farthest_z > 0.0F);
  return out;
}

/// All corners lie beyond one side of the tile.
PADE_INLINE I beyond_a_side(const RasterView& view, const Vec3 (&p)[3], const RasterTile& tile) {
  const auto beyond = [&](V (*coordinate)(const Vec3&), float first, float last) {
    I low = set(-1);
    I high = set(-1);
    for (const Vec3& corner : p) {
      low &= coordinate(corner) < first * corner.z;
      high &= coordinate(corner) > last * corner.z;
    }
    return low | high;
  };
  const float x_first = view.x_of_blocks[tile.left] - 1 / view.fx;
  const float y_first = view.y_of_blocks[tile.top] - 1 / view.fy;
  const float x_last = x_first + static_cast<float>(raster_side * tile.columns + 2) / view.fx;
  const float y_last = y_first + static_cast<float>(raster_side * tile.rows + 2) / view.fy;
  return beyond([](const Vec3& a) { return a.x; }, x_first, x_last) |
         beyond([](const Vec3& a) { return a.y; }, y_first, y_last);
}

/// Small ones, which are the most, that lie behind what all their blocks already show.
PADE_INLINE I hidden(const RasterTile& tile, const Extent& e) {
  const I small = (e.x1 - e.x0 <= 1) & (e.y1 - e.y0 <= 1);
  const I upper = e.y0 * tile.columns;
  const I lower = e.y1 * tile.columns;
  const auto shown = [&](I block) { return gather(tile.farthest_inverse, e.visible ? block : I{}); };
  const V behind =
      min(min(shown(upper + e.x0), shown(upper + e.x1)), min(shown(lower + e.x0), shown(lower + e.x1)));
  return small & (e.nearest <= behind);
}

PADE_INLINE void keep(float (&to)[3][kLanes], const Vec3& function) {
  store(to[0], function.x);
  store(to[1], function.y);
  store(to[2], function.z);
}
PADE_INLINE void keep(int* to, I value) { __builtin_memcpy(to, &value, sizeof value); }

PADE_INLINE void set_up(const RasterView& view, const float (&r)[9], const float (&origin)[3],
                        const TrianglePacket& packet, int first_lane, const RasterTile& tile, Setup& out) {
  Vec3 p[3];
  to_camera(r, origin, packet, first_lane, p);
  out.drawn = 0;
  Extent e = extent_of(view, p, tile);
  if (bits(e.visible & ~e.in_front) != 0) e.visible &= ~beyond_a_side(view, p, tile);
  if (bits(e.visible) == 0) return;
  e.visible &= ~hidden(tile, e);
  if (bits(e.visible) == 0) return;

  const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
  const V from_plane = dot(n, p[0]);
  const V scale = 1.0F / from_plane;
  out.drawn = bits(e.visible & (abs(from_plane) > 1e-30F));
  if (out.drawn == 0) return;

  const I towards = from_plane > 0.0F;
  for (int i = 0; i < 3; ++i) {
    const Vec3& a = p[i];
    const Vec3& b = p[(i + 1) % 3];
    const Vec3 edge = cross(b - a, b + a);
    keep(out.function[i],
         {towards ? -edge.x : edge.x, towards ? -edge.y : edge.y, towards ? -edge.z : edge.z});
  }
  keep(out.function[Setup::kInverseDepth], scale * n);
  // Seen edge on, the inverse depth is a quotient of rounding errors: it stays between those of the corners.
  store(out.nearest, e.nearest);
  store(out.farthest, e.in_front ? 1.0F / e.farthest_z : V{});
  keep(out.x0, e.x0);
  keep(out.y0, e.y0);
  keep(out.x1, e.x1);
  keep(out.y1, e.y1);
}

}  // namespace pade::simulation::PADE_ISA
