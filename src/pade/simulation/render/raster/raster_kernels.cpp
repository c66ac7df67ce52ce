// Compiled once per instruction set (cmake/PadeCompiler.cmake); every set gives the same bits.
#include "pade/simulation/render/raster/raster_kernels.hpp"

#include "pade/simulation/render/raster/raster_setup.hpp"

namespace pade::simulation::PADE_ISA {
namespace {

using simd::PADE_ISA::least;
using simd::PADE_ISA::select;

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
