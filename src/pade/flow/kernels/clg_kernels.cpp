#include "pade/flow/kernels/clg_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {
long clg_scratch(int radius, int width) {
  const long window = window_scratch(6, radius, width);
  const long lines = 24L * (padded(width) + 2L * kRowMultiple);
  return window + lines;
}

void clg_warp(const ClgLevel& level, int first, int last) {
  const auto right = static_cast<float>(level.first.width - 1);
  const auto bottom = static_cast<float>(level.first.height - 1);
  for (int y = first; y < last; ++y) {
    for (int x = 0; x < padded(level.first.width); x += kLanes) {
      const V at_x = load(level.u0.row(y) + x) + (ramp() + static_cast<float>(x));
      const V at_y = load(level.v0.row(y) + x) + static_cast<float>(y);
      const V inside_x = clamp(at_x, 0, right);
      const V inside_y = clamp(at_y, 0, bottom);
      const V here = load(level.first.row(y) + x);
      const I seen = I(at_x == inside_x) & I(at_y == inside_y);
      const V warped = bilinear(level.second.data, level.second.stride, inside_x, inside_y, seen);
      store(level.mean.row(y) + x, select(seen, 0.5F * (here + warped), here));
      store(level.difference.row(y) + x, select(seen, warped - here, V{}));
    }
  }
}

namespace {

/// The motion tensor of a vector of pixels: products of the derivatives, weighted.
struct Tensor {
  V xx, xy, yy, xt, yt, tt;
};

/// Of the brightness, about pixel x of row y.
PADE_INLINE Tensor brightness_tensor(const ClgLevel& level, const Lines<5>& mean, const Lines<3>& difference,
                                     int y, int x) {
  const V gx = along_x(mean[y] + x);
  const V gy =
      five_point(load(mean[y - 2] + x), load(mean[y - 1] + x), load(mean[y + 1] + x), load(mean[y + 2] + x));
  const V gt = load(difference[y] + x);
  const V weight = level.normalisation > 0 ? 1.0F / (gx * gx + gy * gy + level.normalisation) : set(1.0F);
  return {weight * gx * gx, weight * gx * gy, weight * gy * gy,
          weight * gx * gt, weight * gy * gt, weight * gt * gt};
}

/// Adds that of the brightness's gradient.
PADE_INLINE void add_gradient_tensor(const ClgLevel& level, const Lines<5>& mean, const Lines<3>& difference,
                                     int y, int x, Tensor& t) {
  const float* m = mean[y] + x;
  const float* above = mean[y - 1] + x;
  const float* below = mean[y + 1] + x;
  const float* d = difference[y] + x;
  const V gxx = load(m + 1) - 2.0F * load(m) + load(m - 1);
  const V gyy = load(below) - 2.0F * load(m) + load(above);
  const V gxy = 0.25F * ((load(below + 1) - load(below - 1)) - (load(above + 1) - load(above - 1)));
  const V gxt = 0.5F * (load(d + 1) - load(d - 1));
  const V gyt = 0.5F * (load(difference[y + 1] + x) - load(difference[y - 1] + x));
  V wx = set(level.gamma);
  V wy = set(level.gamma);
  if (level.normalisation > 0) {
    wx = level.gamma / (gxx * gxx + gxy * gxy + level.normalisation);
    wy = level.gamma / (gxy * gxy + gyy * gyy + level.normalisation);
  }
  t.xx += wx * gxx * gxx + wy * gxy * gxy;
  t.xy += wx * gxx * gxy + wy * gxy * gyy;
  t.yy += wx * gxy * gxy + wy * gyy * gyy;
  t.xt += wx * gxx * gxt + wy * gxy * gyt;
  t.yt += wx * gxy * gxt + wy * gyy * gyt;
  t.tt += wx * gxt * gxt + wy * gyt * gyt;
}

/// Pixels whose match lies in the second image and that the mask lets through.
PADE_INLINE I seen_pixels(const ClgLevel& level, int y, int x) {
  const auto right = static_cast<float>(level.first.width - 1);
  const auto bottom = static_cast<float>(level.first.height - 1);
  const V at_x = load(level.u0.row(y) + x) + (ramp() + static_cast<float>(x));
  const V at_y = load(level.v0.row(y) + x) + static_cast<float>(y);
  const I seen = I(at_x >= 0.0F) & I(at_x <= right) & I(at_y >= 0.0F) & I(at_y <= bottom);
  return level.mask.data != nullptr ? seen & I(load(level.mask.row(y) + x) > 0.0F) : seen;
}

}  // namespace

void clg_tensor(const ClgLevel& level, int first, int last, float* scratch) {
  const int width = level.first.width;
  const int n = padded(width);
  float* lines = scratch + window_scratch(6, level.radius, width);
  const int begin = first - level.radius < 0 ? 0 : first - level.radius;
  Lines<5> mean(level.mean, lines, begin - 2);
  Lines<3> difference(level.difference, lines + Lines<5>::floats(width), begin - 1);
  const auto products = [&](int y, float* const* out) {
    mean.advance(y + 2);
    difference.advance(y + 1);
    for (int x = 0; x < n; x += kLanes) {
      Tensor t = brightness_tensor(level, mean, difference, y, x);
      if (level.gamma > 0) add_gradient_tensor(level, mean, difference, y, x, t);
      const I seen = seen_pixels(level, y, x);
      const V parts[6] = {t.xx, t.xy, t.yy, t.xt, t.yt, t.tt};
      for (int c = 0; c < 6; ++c) store(out[c] + x, select(seen, parts[c], V{}));
    }
  };
  with_radius(level.radius, [&](auto radius) {
    const auto windows = [&](int y, float* const* line, const float* taps) {
      const PlaneView* planes[6] = {&level.j11, &level.j12, &level.j22, &level.j13, &level.j23, &level.j33};
      for (int c = 0; c < 6; ++c) {
        float* to = planes[c]->row(y);
        for (int x = 0; x < n; x += kLanes) store(to + x, convolve_horizontal(line[c] + x, taps, radius));
      }
    };
    windowed<6>(first, last, width, level.first.height, level.taps, radius, scratch, products, windows);
  });
}

namespace {

// alpha * psi'(|grad u|^2 + |grad v|^2) for the link between a pixel and the next one, `along` and `across`
// being the differences of both components there.
PADE_INLINE V link_weight(const ClgLevel& level, V u_along, V u_across, V v_along, V v_across) {
  if (level.smooth_epsilon2 <= 0) return set(level.alpha);
  const V squared = u_along * u_along + u_across * u_across + v_along * v_along + v_across * v_across;
  return level.alpha / sqrt(squared + level.smooth_epsilon2);
}

/// Weights of the links of row y to the right and down; none beyond the image.
PADE_INLINE void link_row(const ClgLevel& level, const Lines<3>& u, const Lines<3>& v, int y, float* right,
                          float* down) {
  const int width = level.first.width;
  const int n = padded(width);
  for (int x = 0; x < n; x += kLanes) {
    const float* um = u[y - 1] + x;
    const float* u0 = u[y] + x;
    const float* up = u[y + 1] + x;
    const float* vm = v[y - 1] + x;
    const float* v0 = v[y] + x;
    const float* vp = v[y + 1] + x;
    const V uy = load(up) - load(um);
    const V vy = load(vp) - load(vm);
    const V uy_next = load(up + 1) - load(um + 1);
    const V vy_next = load(vp + 1) - load(vm + 1);
    store(right + x, link_weight(level, load(u0 + 1) - load(u0), 0.25F * (uy + uy_next),
                                 load(v0 + 1) - load(v0), 0.25F * (vy + vy_next)));
    const V ux = load(u0 + 1) - load(u0 - 1);
    const V vx = load(v0 + 1) - load(v0 - 1);
    const V ux_next = load(up + 1) - load(up - 1);
    const V vx_next = load(vp + 1) - load(vp - 1);
    store(down + x, link_weight(level, load(up) - load(u0), 0.25F * (ux + ux_next), load(vp) - load(v0),
                                0.25F * (vx + vx_next)));
  }
  if (y < 0 || y >= level.first.height - 1) {
    for (int x = 0; x < n; ++x) down[x] = 0;
  }
  for (int x = width - 1; x < n; ++x) right[x] = 0;
  for (int x = width; x < n; ++x) down[x] = 0;
}

/// The equations of a vector of pixels: inverse 2 x 2 matrix, right-hand side, links to the right and down.
struct Equation {
  V m11, m12, m22, b1, b2, right, below;
};

PADE_INLINE Equation equation_of(const ClgLevel& level, V u, V v, V links, int y, int x) {
  const I real = I(ramp() + static_cast<float>(x) < static_cast<float>(level.first.width));
  const V u0 = load(level.u0.row(y) + x);
  const V v0 = load(level.v0.row(y) + x);
  const V j11 = load(level.j11.row(y) + x);
  const V j12 = load(level.j12.row(y) + x);
  const V j22 = load(level.j22.row(y) + x);
  const V j13 = load(level.j13.row(y) + x);
  const V j23 = load(level.j23.row(y) + x);
  V psi = set(1.0F);
  if (level.data_epsilon2 > 0) {
    const V du = u - u0;
    const V dv = v - v0;
    const V residual =
        load(level.j33.row(y) + x) + du * (j11 * du + 2.0F * (j12 * dv + j13)) + dv * (j22 * dv + 2.0F * j23);
    psi = 1.0F / sqrt(max(residual, V{}) + level.data_epsilon2);
  }
  // A pixel without data and neighbours keeps its flow.
  constexpr float kKeep = 1e-6F;
  const V a11 = psi * j11 + links + kKeep;
  const V a12 = psi * j12;
  const V a22 = psi * j22 + links + kKeep;
  const V scale = 1.0F / (a11 * a22 - a12 * a12);
  Equation out{};
  out.m11 = select(real, a22 * scale, V{});
  out.m12 = select(real, -a12 * scale, V{});
  out.m22 = select(real, a11 * scale, V{});
  out.b1 = select(real, psi * (j11 * u0 + j12 * v0 - j13) + kKeep * u0, V{});
  out.b2 = select(real, psi * (j12 * u0 + j22 * v0 - j23) + kKeep * v0, V{});
  return out;
}

/// Even and odd columns of two neighbouring vectors.
PADE_INLINE void put(const SplitView& to, int y, int x, V a, V b) {
  store(to.even(y) + x / 2, even(a, b));
  store(to.odd(y) + x / 2, odd(a, b));
}

}  // namespace

void clg_system(const ClgLevel& level, int first, int last, float* scratch) {
  const int n = padded(level.first.width);
  const long spacing = n + 2L * kRowMultiple;
  Lines<3> u(level.u, scratch, first - 2);
  Lines<3> v(level.v, scratch + 3 * spacing, first - 2);
  float* right = scratch + 6 * spacing + kRowMultiple;
  float* below[2] = {right + spacing, right + 2 * spacing};
  for (int i = -kRowMultiple; i < 0; ++i) right[i] = 0;
  for (int y = first - 1; y < last; ++y) {
    u.advance(y + 1);
    v.advance(y + 1);
    const float* above = below[(y + 1) & 1];
    float* down = below[y & 1];
    link_row(level, u, v, y, right, down);
    if (y < first) continue;
    const auto equation = [&](int x) {
      const V links = load(right + x) + load(right + x - 1) + load(down + x) + load(above + x);
      Equation out = equation_of(level, load(u[y] + x), load(v[y] + x), links, y, x);
      out.right = load(right + x);
      out.below = load(down + x);
      return out;
    };
    const ClgSystem& s = level.system;
    for (int x = 0; x < n; x += 2 * kLanes) {
      const Equation a = equation(x);
      const Equation b = equation(x + kLanes);
      put(s.m11, y, x, a.m11, b.m11);
      put(s.m12, y, x, a.m12, b.m12);
      put(s.m22, y, x, a.m22, b.m22);
      put(s.b1, y, x, a.b1, b.b1);
      put(s.b2, y, x, a.b2, b.b2);
      put(s.right, y, x, a.right, b.right);
      put(s.below, y, x, a.below, b.below);
    }
  }
}

namespace {

// Updates the pixels of one colour in one row.
PADE_INLINE void relax_row(const ClgSystem& s, int y, int parity, float omega) {
  float* u = s.u.part(y, parity);
  float* v = s.v.part(y, parity);
  const int left =
      parity == 0 ? -1 : 0;  // the left neighbour of an even column 2 k is the odd column 2 (k - 1) + 1
  const float* u_side = s.u.part(y, 1 - parity) + left;
  const float* v_side = s.v.part(y, 1 - parity) + left;
  const float* u_above = s.u.part(y - 1, parity);
  const float* v_above = s.v.part(y - 1, parity);
  const float* u_below = s.u.part(y + 1, parity);
  const float* v_below = s.v.part(y + 1, parity);
  const float* w_left = s.right.part(y, 1 - parity) + left;
  const float* w_right = s.right.part(y, parity);
  const float* w_above = s.below.part(y - 1, parity);
  const float* w_below = s.below.part(y, parity);
  const float* m11 = s.m11.part(y, parity);
  const float* m12 = s.m12.part(y, parity);
  const float* m22 = s.m22.part(y, parity);
  const float* b1 = s.b1.part(y, parity);
  const float* b2 = s.b2.part(y, parity);
  for (int k = 0; k < s.u.half; k += kLanes) {
    const V wl = load(w_left + k);
    const V wr = load(w_right + k);
    const V wa = load(w_above + k);
    const V wb = load(w_below + k);
    const V r1 = (load(b1 + k) + wl * load(u_side + k) + wr * load(u_side + k + 1)) +
                 (wa * load(u_above + k) + wb * load(u_below + k));
    const V r2 = (load(b2 + k) + wl * load(v_side + k) + wr * load(v_side + k + 1)) +
                 (wa * load(v_above + k) + wb * load(v_below + k));
    const V uk = load(u + k);
    const V vk = load(v + k);
    const V c = load(m12 + k);
    store(u + k, uk + omega * (load(m11 + k) * r1 + c * r2 - uk));
    store(v + k, vk + omega * (c * r1 + load(m22 + k) * r2 - vk));
  }
}

}  // namespace

// Half-sweep j visits row y once half-sweep j - 1 has left row y + 1, so all sweeps follow each other down
// the image and work on rows that are still in the cache. The order of operations on each pixel is that of
// plain red-black sweeps.
void clg_relax(const ClgSystem& system, int sweeps, float omega, const SweepRows& rows) {
  const int halves = 2 * sweeps;
  for (int step = rows.first - halves; step < rows.last + 2 * halves; ++step) {
    for (int j = 0; j < halves; ++j) {
      const int y = step - j;
      if (y >= rows.first + j * rows.first_step && y < rows.last + j * rows.last_step)
        relax_row(system, y, (y + j) & 1, omega);
    }
  }
}

void clg_split(PlaneView from, SplitView to, int first, int last) {
  for (int y = first; y < last; ++y) {
    const float* row = from.row(y);
    for (int x = 0; x < padded(from.width); x += 2 * kLanes) {
      const V here = ramp() + static_cast<float>(x);
      const V a = select(I(here < static_cast<float>(from.width)), load(row + x), V{});
      const V b = select(I(here < static_cast<float>(from.width - kLanes)), load(row + x + kLanes), V{});
      store(to.even(y) + x / 2, even(a, b));
      store(to.odd(y) + x / 2, odd(a, b));
    }
  }
}

void clg_join(SplitView from, PlaneView to, int first, int last) {
  for (int y = first; y < last; ++y) {
    float* row = to.row(y);
    for (int x = 0; x < padded(to.width); x += 2 * kLanes) {
      const V a = load(from.even(y) + x / 2);
      const V b = load(from.odd(y) + x / 2);
      store(row + x, zip_low(a, b));
      store(row + x + kLanes, zip_high(a, b));
    }
  }
}

}  // namespace pade::flow::PADE_ISA
