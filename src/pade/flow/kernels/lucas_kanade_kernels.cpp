// Dense Lucas-Kanade in the form of Le Besnerais and Champagnat (2005, FOLKI). With g the gradient of the
// first image and w_q the present flow at pixel q, the residual is linearised at each pixel's own flow:
//   r_q(w) = second(q + w_q) - first(q) + g_q . (w - w_q),
// and the new flow at p minimises sum_q k(q - p) r_q(w)^2 + damping |w - w_p|^2. So the structure tensor
// G = sum k g g^T is that of the first image alone, computed once per level, and an iteration is one warp,
// two windowed sums and one 2 x 2 product:
//   w_p' = (G + damping I)^-1 (sum_q k g_q (g_q . w_q - (second(q + w_q) - first(q))) + damping w_p).
#include "pade/flow/kernels/lucas_kanade_kernels.hpp"

#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {

namespace {
// 1, or 0 where the mask leaves the pixel out.
PADE_INLINE V weight(const LucasKanadeLevel& level, int x, int y) {
  return level.mask.data == nullptr ? set(1.0F) : load(level.mask.row(y) + x);
}
}  // namespace

long lucas_kanade_scratch(int radius, int width) { return window_scratch(3, radius, width); }

void lucas_kanade_prepare(const LucasKanadeLevel& level, int first, int last, float* scratch) {
  const int n = padded(level.first.width);
  with_radius(level.radius, [&](auto radius) {
    windowed<3>(
        first, last, level.first.width, level.first.height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          for (int x = 0; x < n; x += kLanes) {
            const V used = weight(level, x, y);
            const V gx = load(level.gradient_x.row(y) + x) * used;
            const V gy = load(level.gradient_y.row(y) + x) * used;
            store(out[0] + x, gx * gx);
            store(out[1] + x, gx * gy);
            store(out[2] + x, gy * gy);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            const V xx = convolve_horizontal(line[0] + x, taps, radius) + level.damping;
            const V xy = convolve_horizontal(line[1] + x, taps, radius);
            const V yy = convolve_horizontal(line[2] + x, taps, radius) + level.damping;
            // Exactly, the determinant is at least damping^2; rounding must not make it less.
            const V scale = 1.0F / max(xx * yy - xy * xy, set(level.damping * level.damping));
            store(level.inverse_xx.row(y) + x, yy * scale);
            store(level.inverse_xy.row(y) + x, -xy * scale);
            store(level.inverse_yy.row(y) + x, xx * scale);
          }
        });
  });
}

void lucas_kanade_iterate(const LucasKanadeLevel& level, int first, int last, float* scratch) {
  const int width = level.first.width;
  const int height = level.first.height;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  with_radius(level.radius, [&](auto radius) {
    windowed<2>(
        first, last, width, height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          for (int x = 0; x < n; x += kLanes) {
            const V u = load(level.u.row(y) + x);
            const V v = load(level.v.row(y) + x);
            const V at_x = u + (ramp() + static_cast<float>(x));
            const V at_y = v + static_cast<float>(y);
            const V inside_x = clamp(at_x, 0, right);
            const V inside_y = clamp(at_y, 0, bottom);
            const V difference = bilinear(level.second.data, level.second.stride, inside_x, inside_y) -
                                 load(level.first.row(y) + x);
            const V used = weight(level, x, y);
            const V gx = load(level.gradient_x.row(y) + x) * used;
            const V gy = load(level.gradient_y.row(y) + x) * used;
            // Where the flow leaves the image nothing was seen: the residual is that of the present flow,
            // zero.
            const V seen = select(I(at_x == inside_x) & I(at_y == inside_y), difference, V{});
            const V target = gx * u + gy * v - seen;
            store(out[0] + x, gx * target);
            store(out[1] + x, gy * target);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            const V bx =
                convolve_horizontal(line[0] + x, taps, radius) + level.damping * load(level.u.row(y) + x);
            const V by =
                convolve_horizontal(line[1] + x, taps, radius) + level.damping * load(level.v.row(y) + x);
            const V xy = load(level.inverse_xy.row(y) + x);
            store_step(level.u.row(y) + x, level.next_u.row(y) + x,
                       load(level.inverse_xx.row(y) + x) * bx + xy * by, level.largest_step);
            store_step(level.v.row(y) + x, level.next_v.row(y) + x,
                       xy * bx + load(level.inverse_yy.row(y) + x) * by, level.largest_step);
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA
