// Compiled once per instruction set (cmake/PadeCompiler.cmake); every set gives the same bits.
//
// In the camera's frame, with the camera at the origin, pixels are rays d = (x, y, 1). A ray passes an edge
// from p to q on the side that
//   e(d) = d . N,   N = (q - p) x (q + p) = 2 q x p
// says, linear in x and y. Written so, N is the exact negative of the neighbour's, who has the edge from q to
// p, and no ray falls between the two; and it loses nothing where p and q are close together far away. With
// n = (b - a) x (c - a) the inverse depth at d is w = (n . d) / (n . a), linear too. No clipping is needed:
// what lies behind the camera has w <= 0 (Olano and Greer, Triangle scan conversion using 2D homogeneous
// coordinates, 1997).
#include "pade/simulation/render/raster_kernels.hpp"

#include "pade/core/compute/vec.hpp"

namespace pade::simulation::PADE_ISA {
namespace {

using namespace simd::PADE_ISA;  // NOLINT(google-build-using-namespace): the vocabulary of every kernel
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

PADE_INLINE void set_up(const RasterView& view, const float (&r)[9], const float (&origin)[3],
                        const TrianglePacket& packet, int first_lane, const RasterTile& tile, Setup& out) {
  Vec3 p[3];
  for (int i = 0; i < 3; ++i) {
    const Vec3 w = {load(packet.corner[i][0] + first_lane) - origin[0],
                    load(packet.corner[i][1] + first_lane) - origin[1],
                    load(packet.corner[i][2] + first_lane) - origin[2]};
    p[i] = {r[0] * w.x + r[1] * w.y + r[2] * w.z, r[3] * w.x + r[4] * w.y + r[5] * w.z,
            r[6] * w.x + r[7] * w.y + r[8] * w.z};
  }
  // Pixels that can be inside. A triangle that reaches behind the camera may be anywhere; so may one that
  // comes so near to its plane that rounding shows.
  constexpr float kNear = 1e-4F;    // metres
  constexpr float kSteep = 1e-3F;   // z per x and y
  constexpr float kMargin = 0.25F;  // pixels, some four times what rounding takes
  out.drawn = 0;
  const V nearest_z = min(p[0].z, min(p[1].z, p[2].z));
  const V farthest_z = max(p[0].z, max(p[1].z, p[2].z));
  I in_front = nearest_z > kNear;
  for (const Vec3& corner : p)
    in_front &= (corner.z > kSteep * corner.x) & (corner.z > -kSteep * corner.x) &
                (corner.z > kSteep * corner.y) & (corner.z > -kSteep * corner.y);
  V inverse[3], u[3], v[3];
  for (int i = 0; i < 3; ++i) {
    inverse[i] = 1.0F / p[i].z;
    u[i] = view.fx * (p[i].x * inverse[i]) + view.cx;
    v[i] = view.fy * (p[i].y * inverse[i]) + view.cy;
  }
  const V left = set(static_cast<float>(raster_side * tile.left));
  const V top = set(static_cast<float>(raster_side * tile.top));
  const V right = left + static_cast<float>(raster_side * tile.columns - 1);
  const V bottom = top + static_cast<float>(raster_side * tile.rows - 1);
  V u0 = in_front ? min(u[0], min(u[1], u[2])) - kMargin : left;
  V u1 = in_front ? max(u[0], max(u[1], u[2])) + kMargin : right;
  V v0 = in_front ? min(v[0], min(v[1], v[2])) - kMargin : top;
  V v1 = in_front ? max(v[0], max(v[1], v[2])) + kMargin : bottom;
  // The first and the last pixel centre within, counted from the tile's corner (not negative: truncation is
  // the floor, and what is left after it says whether the ceiling is one more).
  u0 = min(max(u0, left), right + 1.0F) - left;
  v0 = min(max(v0, top), bottom + 1.0F) - top;
  u1 = min(max(u1, left - 1.0F), right) - left;
  v1 = min(max(v1, top - 1.0F), bottom) - top;
  const auto ceiling = [](V a) {
    const I whole = truncate(a);
    return whole - (to_float(whole) < a);
  };
  const I x0 = ceiling(u0);
  const I y0 = ceiling(v0);
  const I x1 = truncate(u1 + 1.0F) - 1;  // u1 may be -1
  const I y1 = truncate(v1 + 1.0F) - 1;
  const I bx0 = x0 >> 2, bx1 = x1 >> 2, by0 = y0 >> 2, by1 = y1 >> 2;
  const V nearest = in_front ? 1.0F / nearest_z : set(__builtin_inff());
  I visible = (x0 <= x1) & (y0 <= y1) & (farthest_z > 0.0F);
  if (bits(visible & ~in_front) != 0) {  // nor may all corners lie beyond one side of the tile
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
    visible &= ~beyond([](const Vec3& a) { return a.x; }, x_first, x_last);
    visible &= ~beyond([](const Vec3& a) { return a.y; }, y_first, y_last);
  }
  if (bits(visible) == 0) return;
  // Small ones that lie behind what all their blocks already show are the most.
  const I small = (bx1 - bx0 <= 1) & (by1 - by0 <= 1);
  const I upper = by0 * tile.columns;
  const I lower = by1 * tile.columns;
  const auto shown = [&](I block) { return gather(tile.farthest_inverse, visible ? block : I{}); };
  const V behind =
      min(min(shown(upper + bx0), shown(upper + bx1)), min(shown(lower + bx0), shown(lower + bx1)));
  visible &= ~(small & (nearest <= behind));
  if (bits(visible) == 0) return;

  const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
  const V from_plane = dot(n, p[0]);
  const V scale = 1.0F / from_plane;
  out.drawn = bits(visible & (abs(from_plane) > 1e-30F));
  if (out.drawn == 0) return;

  const I towards = from_plane > 0.0F;
  for (int i = 0; i < 3; ++i) {
    const Vec3& a = p[i];
    const Vec3& b = p[(i + 1) % 3];
    Vec3 edge = cross(b - a, b + a);
    edge = {towards ? -edge.x : edge.x, towards ? -edge.y : edge.y, towards ? -edge.z : edge.z};
    store(out.function[i][0], edge.x);
    store(out.function[i][1], edge.y);
    store(out.function[i][2], edge.z);
  }
  const Vec3 w = scale * n;
  store(out.function[Setup::kInverseDepth][0], w.x);
  store(out.function[Setup::kInverseDepth][1], w.y);
  store(out.function[Setup::kInverseDepth][2], w.z);
  // Seen edge on, w is a quotient of rounding errors: it stays between those of the corners.
  store(out.nearest, nearest);
  store(out.farthest, in_front ? 1.0F / farthest_z : V{});
  const auto keep = [](int* to, I value) { __builtin_memcpy(to, &value, sizeof value); };
  keep(out.x0, bx0);
  keep(out.y0, by0);
  keep(out.x1, bx1);
  keep(out.y1, by1);
}

/// Enters what lies before all else in the lanes of `nearer`, from `pixel` on.
PADE_INLINE void keep_nearer(const RasterTile& tile, int pixel, I nearer, V w, V before, int slot) {
  I slots;
  __builtin_memcpy(&slots, tile.slot + pixel, sizeof slots);
  slots = nearer ? set(slot) : slots;
  __builtin_memcpy(tile.slot + pixel, &slots, sizeof slots);
  store(tile.inverse_depth + pixel, select(nearer, w, before));
}

PADE_INLINE void note_farthest(const RasterTile& tile, int block) {
  const float* w = tile.inverse_depth + block * raster_lanes;
  V farthest = load(w);
  for (int part = 1; part < kParts; ++part) farthest = min(farthest, load(w + part * kLanes));
  tile.farthest_inverse[block] = least(farthest);
}

struct Triangle {
  float x[4], y[4], one[4];  ///< edges and inverse depth
  float nearest, farthest;
  int slot;
};

/// The functions of a triangle in a row of blocks, but for what changes with x.
struct Row {
  V at[kParts][4];
};

PADE_INLINE void draw_block(const Triangle& t, const float* x_of_lanes, const Row& row,
                            const RasterTile& tile, int block) {
  if (t.nearest <= tile.farthest_inverse[block]) return;
  bool changed = false;
  for (int part = 0; part < kParts; ++part) {
    const V x = load(x_of_lanes + part * kLanes);
    const V(&f)[4] = row.at[part];
    const int pixel = block * raster_lanes + part * kLanes;
    const V w = min(max(t.x[3] * x + f[3], set(t.farthest)), set(t.nearest));
    const V before = load(tile.inverse_depth + pixel);
    const I inside = (t.x[0] * x + f[0] >= 0.0F) & (t.x[1] * x + f[1] >= 0.0F) & (t.x[2] * x + f[2] >= 0.0F) &
                     (w > before);
    if (bits(inside) == 0) continue;
    keep_nearer(tile, pixel, inside, w, before, t.slot);
    changed = true;
  }
  if (changed) note_farthest(tile, block);
}

/// Blocks of a row that the triangle may touch and that it may come before, a vector of them at a time.
PADE_INLINE unsigned candidates(const Triangle& t, V x, float y, float width, float height,
                                const float* farthest_inverse) {
  // Twice the rounding of the sum over the pixels, so that what they would find is not lost.
  constexpr float kSlack = 1e-6F;
  I maybe = set(-1);
  for (int i = 0; i < 4; ++i) {
    const float across = t.x[i] * width;
    const float along = t.y[i] * height;
    const float reach =
        (across > 0 ? across : 0) + (along > 0 ? along : 0) +
        kSlack * (__builtin_fabsf(t.x[i]) + __builtin_fabsf(t.y[i]) + __builtin_fabsf(t.one[i]));
    const V most = t.x[i] * x + (t.y[i] * y + t.one[i]) + reach;
    maybe &= i < 3 ? most >= 0.0F : min(max(most, set(t.farthest)), set(t.nearest)) > load(farthest_inverse);
  }
  return bits(maybe);
}

PADE_INLINE void draw(const Triangle& t, const RasterView& view, const RasterTile& tile, int x0, int x1,
                      int y0, int y1) {
  constexpr int kFew = 6;  // blocks in a row: fewer are faster looked at than chosen
  for (int by = y0; by <= y1; ++by) {
    Row row{};
    for (int part = 0; part < kParts; ++part) {
      const V y = load(view.y_of_lanes + (tile.top + by) * raster_lanes + part * kLanes);
      for (int i = 0; i < 4; ++i) row.at[part][i] = t.y[i] * y + t.one[i];
    }
    const int first = by * tile.columns;
    const auto at = [&](int bx) {
      draw_block(t, view.x_of_lanes + (tile.left + bx) * raster_lanes, row, tile, first + bx);
    };
    if (x1 - x0 < kFew) {
      for (int bx = x0; bx <= x1; ++bx) at(bx);
      continue;
    }
    const float width = static_cast<float>(raster_side - 1) / view.fx;
    const float height = static_cast<float>(raster_side - 1) / view.fy;
    for (int from = x0 & ~(kLanes - 1); from <= x1; from += kLanes) {
      unsigned maybe =
          candidates(t, load(view.x_of_blocks + tile.left + from), view.y_of_blocks[tile.top + by], width,
                     height, tile.farthest_inverse + first + from);
      if (from < x0) maybe &= ~0U << (x0 - from);
      if (from + kLanes - 1 > x1) maybe &= (2U << (x1 - from)) - 1;
      for (; maybe != 0; maybe &= maybe - 1) at(from + __builtin_ctz(maybe));
    }
  }
}

}  // namespace

void raster_triangles(const RasterView& view, const TrianglePacket* packets, std::uint32_t first,
                      std::uint32_t last, const RasterTile& tile) {
  float r[9];
  float origin[3];
  for (int i = 0; i < 9; ++i) r[i] = static_cast<float>(view.rotation[i]);
  for (int i = 0; i < 3; ++i) origin[i] = static_cast<float>(view.origin[i]);
  Setup s{};
  for (std::uint32_t part = first * kParts; part < last * kParts; ++part) {
    const std::uint32_t packet = part / kParts;
    const int first_lane = static_cast<int>(part % kParts) * kLanes;
    set_up(view, r, origin, packets[packet], first_lane, tile, s);
    for (unsigned left = s.drawn; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(left);
      Triangle t{};
      for (int i = 0; i < 4; ++i) {
        t.x[i] = s.function[i][0][lane];
        t.y[i] = s.function[i][1][lane];
        t.one[i] = s.function[i][2][lane];
      }
      t.nearest = s.nearest[lane];
      t.farthest = s.farthest[lane];
      t.slot = static_cast<int>(packet) * raster_lanes + first_lane + lane;
      draw(t, view, tile, s.x0[lane], s.x1[lane], s.y0[lane], s.y1[lane]);
    }
  }
}

// As Quadric::intersect(), for sixteen rays.
void raster_quadric(const RasterView& view, const QuadricView& quadric, const RasterTile& tile, int x0,
                    int x1, int y0, int y1) {
  const double* o = quadric.origin;
  const double* m = quadric.direction;
  const double in_z = quadric.round_in_z ? 1 : 0;
  const double reach = quadric.round_in_z ? 2 : 1;  // a sphere ends by itself
  for (int by = y0; by <= y1; ++by) {
    for (int bx = x0; bx <= x1; ++bx) {
      const int block = by * tile.columns + bx;
      if (quadric.nearest <= tile.farthest_inverse[block]) continue;
      const double* x = view.x_of_pixels + raster_side * (tile.left + bx);
      const double* y = view.y_of_pixels + raster_side * (tile.top + by);
      alignas(64) double xs[raster_lanes], ys[raster_lanes];
      for (int i = 0; i < raster_lanes; ++i) {
        xs[i] = x[i % raster_side];
        ys[i] = y[i / raster_side];
      }
      constexpr double kInfinity = __builtin_inf();
      alignas(64) float found[raster_lanes];
      for (int i = 0; i < raster_lanes; ++i) {
        const double dx = m[0] * xs[i] + m[1] * ys[i] + m[2];
        const double dy = m[3] * xs[i] + m[4] * ys[i] + m[5];
        const double dz = m[6] * xs[i] + m[7] * ys[i] + m[8];
        const double a = dx * dx + dy * dy + in_z * (dz * dz);
        const double foot = -(o[0] * dx + o[1] * dy + in_z * (o[2] * dz)) / a;
        const double fx = o[0] + foot * dx;
        const double fy = o[1] + foot * dy;
        const double fz = o[2] + foot * dz;
        const double inside = 1 - (fx * fx + fy * fy + in_z * (fz * fz));
        const double half_chord = __builtin_sqrt((inside > 0 ? inside : 0) / a);
        const double t1 = foot - half_chord;
        const double t2 = foot + half_chord;
        const double z1 = o[2] + t1 * dz;
        const double z2 = o[2] + t2 * dz;
        const bool crosses = inside >= 0;  // not where a = 0
        const bool first = crosses & (t1 > 0) & (z1 <= reach) & (z1 >= -reach);
        const bool second = crosses & (t2 > 0) & (z2 <= reach) & (z2 >= -reach);
        const double t = first ? t1 : second ? t2 : kInfinity;
        found[i] = static_cast<float>(1 / t);
      }
      if (quadric.capped) {
        for (const double z : {-1.0, 1.0}) {
          for (int i = 0; i < raster_lanes; ++i) {
            const double dx = m[0] * xs[i] + m[1] * ys[i] + m[2];
            const double dy = m[3] * xs[i] + m[4] * ys[i] + m[5];
            const double dz = m[6] * xs[i] + m[7] * ys[i] + m[8];
            const double t = (z - o[2]) / dz;
            const double px = o[0] + t * dx;
            const double py = o[1] + t * dy;
            const auto w = static_cast<float>(1 / t);
            const bool hit = (px * px + py * py <= 1) & (t > 0) & (w > found[i]);
            found[i] = hit ? w : found[i];
          }
        }
      }
      bool changed = false;
      for (int part = 0; part < kParts; ++part) {
        const int pixel = block * raster_lanes + part * kLanes;
        const V w = load(found + part * kLanes);
        const V before = load(tile.inverse_depth + pixel);
        const I nearer = w > before;
        if (bits(nearer) == 0) continue;
        keep_nearer(tile, pixel, nearer, w, before, static_cast<int>(quadric.slot));
        changed = true;
      }
      if (changed) note_farthest(tile, block);
    }
  }
}

void raster_depth(const RasterView& view, const TrianglePlane* planes, const RasterTile& tile, float* depth) {
  const double* r = view.rotation;
  for (int by = 0; by < tile.rows; ++by) {
    for (int bx = 0; bx < tile.columns; ++bx) {
      const int block = (by * tile.columns + bx) * raster_lanes;
      const std::uint32_t* slots = tile.slot + block;
      alignas(64) double nx[raster_lanes], ny[raster_lanes], nz[raster_lanes], offset[raster_lanes];
      for (int i = 0; i < raster_lanes; ++i) {
        const bool plane = tile.inverse_depth[block + i] > 0 && (slots[i] >> 31) == 0;
        const TrianglePlane& p = planes[plane ? slots[i] : 0];
        nx[i] = p.normal[0];
        ny[i] = p.normal[1];
        nz[i] = p.normal[2];
        offset[i] = plane ? p.offset : __builtin_nan("");
      }
      const double* x = view.x_of_pixels + raster_side * (tile.left + bx);
      const double* y = view.y_of_pixels + raster_side * (tile.top + by);
      for (int i = 0; i < raster_lanes; ++i) {
        const double dx = x[i % raster_side];
        const double dy = y[i / raster_side];
        const double wx = r[0] * dx + r[3] * dy + r[6];
        const double wy = r[1] * dx + r[4] * dy + r[7];
        const double wz = r[2] * dx + r[5] * dy + r[8];
        const double exact =
            (offset[i] - (nx[i] * view.origin[0] + ny[i] * view.origin[1] + nz[i] * view.origin[2])) /
            (nx[i] * wx + ny[i] * wy + nz[i] * wz);
        const float w = tile.inverse_depth[block + i];
        const double about = 1.0 / static_cast<double>(w);
        const double error = exact > about ? exact - about : about - exact;
        const double kept = error < 1e-3 * about ? exact : about;
        depth[block + i] = w > 0 ? static_cast<float>(kept) : __builtin_nanf("");
      }
    }
  }
}

}  // namespace pade::simulation::PADE_ISA
