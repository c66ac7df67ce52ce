// Lucas-Kanade and CLG with one unknown. The true flow lies on the pixel's epipolar line,
//   w = w_infinity + lambda e,   |e| = 1,
// exactly, for any motion of the camera in a static scene. With the slope a = g . e the brightness residual
// is
//   r(lambda) = second(p + w) - first(p) + a (lambda - lambda_p),
// and everything that was a 2 x 2 system in the general methods becomes a division:
//   Lucas-Kanade   lambda' = (sum k a (a lambda_q - r_q) + damping lambda_p) / (sum k a^2 + damping)
//   CLG            lambda' = (psi (J11 lambda_0 - J13) + sum_j w_j lambda_j) / (psi J11 + sum_j w_j)
// CLG's smoothness is that of lambda, which unlike the whole flow does not vary with the camera's rotation.
#include "pade/flow/kernels/epipolar_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {

namespace {

PADE_INLINE I finite(V a) {
  constexpr int kExponent = 0x7f800000;
  return (I(a) & kExponent) != kExponent;
}

// Where the line puts the pixels from (x, y) on at the distances d.
struct Target {
  V x, y;

  [[gnu::always_inline]] Target(const EpipolarLevel& e, V d, int from_x, int from_y)
      : x(load(e.base_u.row(from_y) + from_x) + d * load(e.direction_x.row(from_y) + from_x) +
          (ramp() + static_cast<float>(from_x))),
        y(load(e.base_v.row(from_y) + from_x) + d * load(e.direction_y.row(from_y) + from_x) +
          static_cast<float>(from_y)) {}
};

}  // namespace

void split_components(const float* from, float* x, float* y, int width) {
  int i = 0;
  for (; i + kLanes <= width; i += kLanes) {
    const V a = load(from + 2L * i);
    const V b = load(from + 2L * i + kLanes);
    const V xs = even(a, b);
    const V ys = odd(a, b);
    const I known = finite(xs) & finite(ys);
    store(x + i, select(known, xs, V{}));
    store(y + i, select(known, ys, V{}));
  }
  for (; i < padded(width); ++i) {
    const float* pair = from + 2L * (i < width ? i : width - 1);
    const bool known = __builtin_isfinite(pair[0]) && __builtin_isfinite(pair[1]);
    x[i] = known ? pair[0] : 0;
    y[i] = known ? pair[1] : 0;
  }
}

void every_other(PlaneView from, PlaneView to, float factor, int first, int last) {
  for (int y = first; y < last; ++y) {
    const float* row = from.row(2 * y);
    float* out = to.row(y);
    for (int x = 0; x < to.width; ++x) out[x] = row[2 * x] * factor;
    for (int x = to.width; x < padded(to.width); ++x) out[x] = out[to.width - 1];
  }
}

void epipolar_flow(const EpipolarLevel& line, PlaneView distance, PlaneView u, PlaneView v, int first,
                   int last) {
  for (int y = first; y < last; ++y) {
    for (int x = 0; x < padded(distance.width); x += kLanes) {
      const V d = load(distance.row(y) + x);
      store(u.row(y) + x, load(line.base_u.row(y) + x) + d * load(line.direction_x.row(y) + x));
      store(v.row(y) + x, load(line.base_v.row(y) + x) + d * load(line.direction_y.row(y) + x));
    }
  }
}

void epipolar_lk_slope(const EpipolarLucasKanade& level, int first, int last, float* scratch) {
  Lines<5> lines(level.first, scratch, first - 2);
  for (int y = first; y < last; ++y) {
    lines.advance(y + 2);
    for (int x = 0; x < padded(level.first.width); x += kLanes) {
      const V gx = along_x(lines[y] + x);
      const V gy = five_point(load(lines[y - 2] + x), load(lines[y - 1] + x), load(lines[y + 1] + x),
                              load(lines[y + 2] + x));
      store(level.slope.row(y) + x,
            gx * load(level.line.direction_x.row(y) + x) + gy * load(level.line.direction_y.row(y) + x));
    }
  }
}

void epipolar_lk_prepare(const EpipolarLucasKanade& level, int first, int last, float* scratch) {
  const int n = padded(level.first.width);
  with_radius(level.radius, [&](auto radius) {
    windowed<1>(
        first, last, level.first.width, level.first.height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          for (int x = 0; x < n; x += kLanes) {
            const V a = load(level.slope.row(y) + x);
            store(out[0] + x, a * a);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            store(level.inverse.row(y) + x,
                  1.0F / (convolve_horizontal(line[0] + x, taps, radius) + level.damping));
          }
        });
  });
}

void epipolar_lk_iterate(const EpipolarLucasKanade& level, int first, int last, float* scratch) {
  const int width = level.first.width;
  const int height = level.first.height;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  const EpipolarLevel& e = level.line;
  with_radius(level.radius, [&](auto radius) {
    windowed<1>(
        first, last, width, height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          for (int x = 0; x < n; x += kLanes) {
            const V d = load(level.distance.row(y) + x);
            const Target at(e, d, x, y);
            const V inside_x = clamp(at.x, 0, right);
            const V inside_y = clamp(at.y, 0, bottom);
            const V difference = bilinear(level.second.data, level.second.stride, inside_x, inside_y) -
                                 load(level.first.row(y) + x);
            const V seen = select(I(at.x == inside_x) & I(at.y == inside_y), difference, V{});
            const V a = load(level.slope.row(y) + x);
            store(out[0] + x, a * (a * d - seen));
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            const V b = convolve_horizontal(line[0] + x, taps, radius) +
                        level.damping * load(level.distance.row(y) + x);
            store_step(level.distance.row(y) + x, level.next_distance.row(y) + x,
                       load(level.inverse.row(y) + x) * b, level.largest_step);
          }
        });
  });
}

void epipolar_clg_warp(const EpipolarClg& level, int first, int last) {
  const int width = level.first.width;
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(level.first.height - 1);
  for (int y = first; y < last; ++y) {
    const auto warp = [&](int x) {
      const V d = load(level.distance.row(y) + x);
      store(level.distance0.row(y) + x, d);
      const Target at(level.line, d, x, y);
      const V inside_x = clamp(at.x, 0, right);
      const V inside_y = clamp(at.y, 0, bottom);
      const V here = load(level.first.row(y) + x);
      const V warped = bilinear(level.second.data, level.second.stride, inside_x, inside_y);
      const I seen = I(at.x == inside_x) & I(at.y == inside_y);
      store(level.mean.row(y) + x, select(seen, 0.5F * (here + warped), here));
      store(level.difference.row(y) + x, select(seen, warped - here, V{}));
      return select(I(ramp() + static_cast<float>(x) < static_cast<float>(width)), d, V{});
    };
    for (int x = 0; x < padded(width); x += 2 * kLanes) {
      const V a = warp(x);
      const V b = warp(x + kLanes);
      store(level.split_distance.even(y) + x / 2, even(a, b));
      store(level.split_distance.odd(y) + x / 2, odd(a, b));
    }
  }
}

void epipolar_clg_tensor(const EpipolarClg& level, int first, int last, float* scratch) {
  const int width = level.mean.width;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(level.mean.height - 1);
  const EpipolarLevel& e = level.line;
  float* lines = scratch + window_scratch(3, level.radius, width);
  const int begin = first - level.radius < 0 ? 0 : first - level.radius;
  Lines<5> mean(level.mean, lines, begin - 2);
  Lines<3> difference(level.difference, lines + Lines<5>::floats(width), begin - 1);
  with_radius(level.radius, [&](auto radius) {
    windowed<3>(
        first, last, width, level.mean.height, level.taps, radius, scratch,
        [&](int y, float* const* out) {
          mean.advance(y + 2);
          difference.advance(y + 1);
          for (int x = 0; x < n; x += kLanes) {
            const float* m = mean[y] + x;
            const float* above = mean[y - 1] + x;
            const float* below = mean[y + 1] + x;
            const float* d = difference[y] + x;
            const V ex = load(e.direction_x.row(y) + x);
            const V ey = load(e.direction_y.row(y) + x);
            const V a =
                along_x(m) * ex +
                five_point(load(mean[y - 2] + x), load(above), load(below), load(mean[y + 2] + x)) * ey;
            const V gt = load(d);
            // The derivatives of a, and those of the residual: constancy of the gradient.
            const V gxy = 0.25F * ((load(below + 1) - load(below - 1)) - (load(above + 1) - load(above - 1)));
            const V ax = (load(m + 1) - 2.0F * load(m) + load(m - 1)) * ex + gxy * ey;
            const V ay = gxy * ex + (load(below) - 2.0F * load(m) + load(above)) * ey;
            const V xt = 0.5F * (load(d + 1) - load(d - 1));
            const V yt = 0.5F * (load(difference[y + 1] + x) - load(difference[y - 1] + x));
            const Target at(e, load(level.distance0.row(y) + x), x, y);
            const I seen = I(at.x >= 0.0F) & I(at.x <= right) & I(at.y >= 0.0F) & I(at.y <= bottom);
            store(out[0] + x, select(seen, a * a + level.gamma * (ax * ax + ay * ay), V{}));
            store(out[1] + x, select(seen, a * gt + level.gamma * (ax * xt + ay * yt), V{}));
            store(out[2] + x, select(seen, gt * gt + level.gamma * (xt * xt + yt * yt), V{}));
          }
        },
        [&](int y, float* const* line, const float* taps) {
          const PlaneView* planes[3] = {&level.j11, &level.j13, &level.j33};
          for (int c = 0; c < 3; ++c) {
            for (int x = 0; x < n; x += kLanes) {
              store(planes[c]->row(y) + x, convolve_horizontal(line[c] + x, taps, radius));
            }
          }
        });
  });
}

namespace {

PADE_INLINE V link_weight(const EpipolarClg& level, V along, V across) {
  if (level.smooth_epsilon2 <= 0) return set(level.alpha);
  return level.alpha / sqrt(along * along + across * across + level.smooth_epsilon2);
}

}  // namespace

void epipolar_clg_system(const EpipolarClg& level, int first, int last, float* scratch) {
  const int width = level.mean.width;
  const int height = level.mean.height;
  const int n = padded(width);
  const long spacing = n + 2L * kRowMultiple;
  Lines<3> d(level.distance, scratch, first - 2);
  float* right = scratch + 3 * spacing + kRowMultiple;
  float* below[2] = {right + spacing, right + 2 * spacing};
  for (int i = -kRowMultiple; i < 0; ++i) right[i] = 0;
  for (int y = first - 1; y < last; ++y) {
    d.advance(y + 1);
    float* down = below[y & 1];
    for (int x = 0; x < n; x += kLanes) {
      const float* up = d[y - 1] + x;
      const float* here = d[y] + x;
      const float* next = d[y + 1] + x;
      const V across_y = load(next) - load(up);
      const V across_y_right = load(next + 1) - load(up + 1);
      store(right + x, link_weight(level, load(here + 1) - load(here), 0.25F * (across_y + across_y_right)));
      const V across_x = load(here + 1) - load(here - 1);
      const V across_x_below = load(next + 1) - load(next - 1);
      store(down + x, link_weight(level, load(next) - load(here), 0.25F * (across_x + across_x_below)));
    }
    if (y < 0 || y >= height - 1) {
      for (int x = 0; x < n; ++x) down[x] = 0;
    }
    for (int x = width - 1; x < n; ++x) right[x] = 0;
    for (int x = width; x < n; ++x) down[x] = 0;
    if (y < first) continue;
    const float* up_weight = below[(y + 1) & 1];
    const auto equation = [&](int x, V(&out)[4]) {
      constexpr float kKeep = 1e-6F;  // a pixel without data and neighbours keeps its distance
      const I real = I(ramp() + static_cast<float>(x) < static_cast<float>(width));
      const V d0 = load(level.distance0.row(y) + x);
      const V j11 = load(level.j11.row(y) + x);
      const V j13 = load(level.j13.row(y) + x);
      V psi = set(1.0F);
      if (level.data_epsilon2 > 0) {
        const V step = load(d[y] + x) - d0;
        const V residual = load(level.j33.row(y) + x) + step * (j11 * step + 2.0F * j13);
        psi = 1.0F / sqrt(max(residual, V{}) + level.data_epsilon2);
      }
      const V links = load(right + x) + load(right + x - 1) + load(down + x) + load(up_weight + x);
      out[0] = select(real, 1.0F / (psi * j11 + links + kKeep), V{});
      out[1] = select(real, psi * (j11 * d0 - j13) + kKeep * d0, V{});
      out[2] = load(right + x);
      out[3] = load(down + x);
    };
    const SplitView* to[4] = {&level.inverse, &level.right_hand_side, &level.right, &level.below};
    for (int x = 0; x < n; x += 2 * kLanes) {
      V a[4];
      V b[4];
      equation(x, a);
      equation(x + kLanes, b);
      for (int c = 0; c < 4; ++c) {
        store(to[c]->even(y) + x / 2, even(a[c], b[c]));
        store(to[c]->odd(y) + x / 2, odd(a[c], b[c]));
      }
    }
  }
}

// The order of visits is that of clg_relax.
void epipolar_clg_relax(const EpipolarClg& level, int sweeps, float omega) {
  const SplitView& d = level.split_distance;
  for (int step = 0; step < d.height + 2 * sweeps - 1; ++step) {
    for (int j = 0; j < 2 * sweeps; ++j) {
      const int y = step - j;
      if (y < 0 || y >= d.height) continue;
      const int parity = (y + j) & 1;
      const int left = parity == 0 ? -1 : 0;
      float* here = d.part(y, parity);
      const float* side = d.part(y, 1 - parity) + left;
      const float* above = d.part(y - 1, parity);
      const float* below = d.part(y + 1, parity);
      const float* w_left = level.right.part(y, 1 - parity) + left;
      const float* w_right = level.right.part(y, parity);
      const float* w_above = level.below.part(y - 1, parity);
      const float* w_below = level.below.part(y, parity);
      const float* inverse = level.inverse.part(y, parity);
      const float* b = level.right_hand_side.part(y, parity);
      for (int k = 0; k < d.half; k += kLanes) {
        const V sum =
            (load(b + k) + load(w_left + k) * load(side + k) + load(w_right + k) * load(side + k + 1)) +
            (load(w_above + k) * load(above + k) + load(w_below + k) * load(below + k));
        const V old = load(here + k);
        store(here + k, old + omega * (load(inverse + k) * sum - old));
      }
    }
  }
}

}  // namespace pade::flow::PADE_ISA
