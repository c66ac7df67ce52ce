// Two-frame motion from polynomial expansion (Farneback 2003). Around each pixel the image is fitted by a
// quadratic with Gaussian weights (separably). Where the second image is the first one moved by d, the linear
// parts differ by b2 = b1 - 2 A d. With a present flow rounded to whole pixels, d~, the second expansion is
// read at p + d~, and
//   A = (A1(p) + A2(p + d~)) / 2,   db = (b1(p) - b2(p + d~)) / 2 + A d~,   A d = db.
// The rounding costs nothing, since A d~ puts the whole of it back, and saves the interpolation of five
// planes. The least-squares flow over a window k, with a pull toward the present flow that decides where the
// window says nothing:
//   (sum k A^T A + damping I) d = sum k A^T db + damping d_present.
#include "pade/flow/kernels/farneback_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {
namespace {

// The value of an antisymmetric filter: sum of taps[i] (row[i] - row[-i]).
PADE_INLINE V convolve_odd(const float* row, const float* taps, int radius) {
  V sum{};
  for (int i = 1; i <= radius; ++i) sum += taps[i] * (load(row + i) - load(row - i));
  return sum;
}

// Two present flows can differ by less than a rounding step, so ties must not depend on the machine.
PADE_INLINE V round_to_whole(V a) { return to_float(truncate(a + select(a < 0.0F, set(-0.5F), set(0.5F)))); }

}  // namespace

long farneback_scratch(int radius, int width) { return window_scratch(5, radius, width); }

void farneback_expand(PlaneView image, const ExpansionView& expansion, const ExpansionFilters& filters,
                      int first, int last, float* scratch) {
  const int n = padded(image.width);
  const int radius = filters.radius;
  const long spacing = n + 2 * kRowMultiple;
  float* m0 = scratch + kRowMultiple;
  float* m1 = m0 + spacing;
  float* m2 = m1 + spacing;
  for (int y = first; y < last; ++y) {
    const float* rows[2 * kMaxRadius + 1] = {};
    for (int i = -radius; i <= radius; ++i) rows[i + radius] = image.row(clamp_index(y + i, image.height));
    for (int x = 0; x < n; x += kLanes) {
      const V middle = load(rows[radius] + x);
      V sum0 = filters.g[0] * middle;
      V sum1{};
      V sum2{};
      for (int i = 1; i <= radius; ++i) {
        const V above = load(rows[radius - i] + x);
        const V below = load(rows[radius + i] + x);
        sum0 += filters.g[i] * (above + below);
        sum1 += filters.xg[i] * (below - above);
        sum2 += filters.xxg[i] * (above + below);
      }
      store(m0 + x, sum0);
      store(m1 + x, sum1);
      store(m2 + x, sum2);
    }
    repeat_edges(m0, image.width, radius);
    repeat_edges(m1, image.width, radius);
    repeat_edges(m2, image.width, radius);
    for (int x = 0; x < n; x += kLanes) {
      const V mean = convolve_horizontal(m0 + x, filters.g, radius);
      const V xx = convolve_horizontal(m0 + x, filters.xxg, radius);
      const V yy = convolve_horizontal(m2 + x, filters.g, radius);
      store(expansion.bx.row(y) + x, filters.linear * convolve_odd(m0 + x, filters.xg, radius));
      store(expansion.by.row(y) + x, filters.linear * convolve_horizontal(m1 + x, filters.g, radius));
      store(expansion.axx.row(y) + x, filters.constant * mean + filters.square * xx);
      store(expansion.ayy.row(y) + x, filters.constant * mean + filters.square * yy);
      store(expansion.axy.row(y) + x, filters.product * convolve_odd(m1 + x, filters.xg, radius));
    }
  }
}

void farneback_iterate(const FarnebackLevel& level, int first, int last, float* scratch) {
  const int width = level.u.width;
  const int height = level.u.height;
  const int stride = level.u.stride;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  with_radius(level.radius, [&](auto radius) {
    windowed<5>(
        first, last, width, height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          for (int x = 0; x < n; x += kLanes) {
            const V here = ramp() + static_cast<float>(x);
            const V target_x = here + round_to_whole(clamp(load(level.u.row(y) + x), -right, right));
            const V target_y =
                static_cast<float>(y) + round_to_whole(clamp(load(level.v.row(y) + x), -bottom, bottom));
            const V at_x = clamp(target_x, 0, right);
            const V at_y = clamp(target_y, 0, bottom);
            I seen = I(at_x == target_x) & I(at_y == target_y);
            if (level.mask.data != nullptr) seen = seen & I(load(level.mask.row(y) + x) > 0.0F);
            const I at = truncate(at_y) * stride + truncate(at_x);
            const ExpansionView& to = level.second;
            const float* const planes[5] = {to.axx.data, to.ayy.data, to.axy.data, to.bx.data, to.by.data};
            V second[5];
            fetch(planes, at, second);
            const V du = at_x - here;
            const V dv = at_y - static_cast<float>(y);
            const V axx = 0.5F * (load(level.first.axx.row(y) + x) + second[0]);
            const V ayy = 0.5F * (load(level.first.ayy.row(y) + x) + second[1]);
            // Half of the mixed coefficient is the matrix's off-diagonal; another half averages the images.
            const V axy = 0.25F * (load(level.first.axy.row(y) + x) + second[2]);
            const V bx = 0.5F * (load(level.first.bx.row(y) + x) - second[3]) + axx * du + axy * dv;
            const V by = 0.5F * (load(level.first.by.row(y) + x) - second[4]) + axy * du + ayy * dv;
            // What leaves the image has no weight.
            store(out[0] + x, select(seen, axx * axx + axy * axy, V{}));
            store(out[1] + x, select(seen, axy * (axx + ayy), V{}));
            store(out[2] + x, select(seen, ayy * ayy + axy * axy, V{}));
            store(out[3] + x, select(seen, axx * bx + axy * by, V{}));
            store(out[4] + x, select(seen, axy * bx + ayy * by, V{}));
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            const V xx = convolve_horizontal(line[0] + x, taps, radius) + level.damping;
            const V xy = convolve_horizontal(line[1] + x, taps, radius);
            const V yy = convolve_horizontal(line[2] + x, taps, radius) + level.damping;
            const V hx =
                convolve_horizontal(line[3] + x, taps, radius) + level.damping * load(level.u.row(y) + x);
            const V hy =
                convolve_horizontal(line[4] + x, taps, radius) + level.damping * load(level.v.row(y) + x);
            const V scale = 1.0F / max(xx * yy - xy * xy, set(level.damping * level.damping));
            store_step(level.u.row(y) + x, level.next_u.row(y) + x, (yy * hx - xy * hy) * scale,
                       level.largest_step);
            store_step(level.v.row(y) + x, level.next_v.row(y) + x, (xx * hy - xy * hx) * scale,
                       level.largest_step);
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA
