// Inverse depth from several views. With H p~ the point at infinity and e the motion of the camera, both in
// homogeneous pixels, a point at the distance d (inverse depth times a constant) is seen at
//   p'(d) = pi(H p~ + d e),   dp'/dd = (e_xy - p' e_z) / z,   z = (H p~ + d e)_z = Z' / Z,
// for any motion. Linearised about the present d, each view is one epipolar pair (epipolar_kernels.cpp) whose
// directions are not of unit length: longer baselines have longer ones, and so the weight that they deserve.
// Their tensors add up, each with the robust weight of its own residual: a view in which the point is hidden
// does not count.
#include "pade/flow/kernels/multi_view_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {

namespace {
// As in confidence_kernels.cpp: the share of the gradients that a right match does not leave standing.
constexpr float kWrong = 0.1F;
constexpr float kSlack = 0.5F;
// Squared slopes, per grey^2 of noise, that are no texture: noise alone makes 0.9.
constexpr float kSlopeNoise = 1.5F;
constexpr float kTruncated = 20;       // grey values: farther off is as wrong
constexpr float kLeastNoise2 = 0.09F;  // grey values squared: that of rounding
constexpr int kChannels = 6;

PADE_INLINE void add(float* to, V value, bool reset) { store(to, reset ? value : load(to) + value); }

// Where a view sees points.
struct Point {
  V x, y, per_z;
  I used;
};

// One row of the reference.
struct Row {
  ViewGeometry g;
  float v, rx, ry, rz, least_z;

  [[gnu::always_inline]] Row(const ViewGeometry& view, int y)
      : g(view),
        v(static_cast<float>(y)),
        rx(g.H[1] * v + g.H[2]),
        ry(g.H[4] * v + g.H[5]),
        rz(g.H[7] * v + g.H[8]),
        least_z(1 / g.largest_scale) {}

  [[gnu::always_inline]] Point at(V u, V d) const {
    const V hx = g.H[0] * u + rx;
    const V hy = g.H[3] * u + ry;
    const V hz = g.H[6] * u + rz;
    const V z = hz + d * g.e[2];
    const V per_both = 1.0F / (z * hz);
    const V per_hz = z * per_both;
    Point p;
    p.per_z = hz * per_both;
    p.x = (hx + d * g.e[0]) * p.per_z;
    p.y = (hy + d * g.e[1]) * p.per_z;
    const V px = p.x - hx * per_hz;
    const V py = p.y - hy * per_hz;
    p.used = I(hz > 0.0F) & I(z > least_z * hz) & I(z < g.largest_scale * hz) &
             I(px * px + py * py <= g.largest_parallax2);
    return p;
  }
  // dp'/dd
  [[gnu::always_inline]] V along_x(const Point& p) const { return (g.e[0] - p.x * g.e[2]) * p.per_z; }
  [[gnu::always_inline]] V along_y(const Point& p) const { return (g.e[1] - p.y * g.e[2]) * p.per_z; }
};

// A view's rows, warped to the reference, each once: row y of the image, also outside of it, at (y). Two rows
// back and ahead of the last one that was asked for are there.
template <bool kWithMean>
class Warped {
 public:
  Warped(const ViewGeometry& view, PlaneView first, PlaneView second, PlaneView distance, float* scratch,
         int row)
      : view_(view),
        first_(first),
        second_(second),
        distance_(distance),
        memory_(scratch),
        done_(row < 0 ? 0 : row) {}
  static long floats(int width) { return kPlanes * kRows * line(width); }

  // Makes rows up to `last` available.
  [[gnu::always_inline]] void advance(int last) {
    for (; done_ <= last && done_ < first_.height; ++done_) warp(done_);
  }
  const float* residual(int y) const { return slot(kResidual, y); }  // warped - first; 0 = not seen
  const float* along_x(int y) const { return slot(kAlongX, y); }     // dp'/dd; 0 = not seen
  const float* along_y(int y) const { return slot(kAlongY, y); }
  const float* mean(int y) const { return slot(kMean, y); }  // of both images; the first's where not seen

 private:
  static constexpr int kRows = 5;
  enum { kResidual, kAlongX, kAlongY, kMean };
  static constexpr int kPlanes = kWithMean ? 4 : 3;
  static long line(int width) { return padded(width) + 2L * kRowMultiple; }

  float* slot(int plane, int y) const {
    const int row = clamp_index(y, first_.height) % kRows;
    return memory_ + (plane * kRows + row) * line(first_.width) + kRowMultiple;
  }
  [[gnu::always_inline]] void warp(int y) {
    const Row row(view_, y);
    const auto right = static_cast<float>(first_.width - 1);
    const auto bottom = static_cast<float>(first_.height - 1);
    for (int x = 0; x < padded(first_.width); x += kLanes) {
      const Point at = row.at(ramp() + static_cast<float>(x), load(distance_.row(y) + x));
      const V inside_x = clamp(at.x, 0, right);
      const V inside_y = clamp(at.y, 0, bottom);
      const I seen = at.used & I(inside_x == at.x) & I(inside_y == at.y);
      const V here = load(first_.row(y) + x);
      const V there = bilinear(second_.data, second_.stride, inside_x, inside_y, seen);
      store(slot(kResidual, y) + x, select(seen, there - here, V{}));
      store(slot(kAlongX, y) + x, select(seen, row.along_x(at), V{}));
      store(slot(kAlongY, y) + x, select(seen, row.along_y(at), V{}));
      if constexpr (kWithMean) store(slot(kMean, y) + x, select(seen, 0.5F * (here + there), here));
    }
    repeat_edges(slot(kResidual, y), first_.width, 4);
    if constexpr (kWithMean) repeat_edges(slot(kMean, y), first_.width, 4);
  }
  const ViewGeometry& view_;
  PlaneView first_, second_, distance_;
  float* memory_;
  int done_;
};

}  // namespace

long tensor_scratch(int radius, int width) {
  return window_scratch(3, radius, width) + Warped<true>::floats(width);
}

void view_tensor(const ViewGeometry& view, const ViewTensor& t, bool reset, int first, int last,
                 float* scratch) {
  const int width = t.first.width;
  const int n = padded(width);
  const int begin = first - t.radius < 0 ? 0 : first - t.radius;
  Warped<true> warped(view, t.first, t.second, t.distance, scratch + window_scratch(3, t.radius, width),
                      begin - 2);
  with_radius(t.radius, [&](auto radius) {
    windowed<3>(
        first, last, width, t.first.height, t.taps, radius, scratch,
        [&](int y, float* const* out) {
          warped.advance(y + 2);
          const float* const far_above = warped.mean(y - 2);
          const float* const above = warped.mean(y - 1);
          const float* const here = warped.mean(y);
          const float* const below = warped.mean(y + 1);
          const float* const far_below = warped.mean(y + 2);
          const float* const r = warped.residual(y);
          const float* const r_above = warped.residual(y - 1);
          const float* const r_below = warped.residual(y + 1);
          const float* const along_x_of = warped.along_x(y);
          const float* const along_y_of = warped.along_y(y);
          for (int x = 0; x < n; x += kLanes) {
            const V ex = load(along_x_of + x);
            const V ey = load(along_y_of + x);
            const V gx = along_x(here + x);
            const V gy =
                five_point(load(far_above + x), load(above + x), load(below + x), load(far_below + x));
            const V a = gx * ex + gy * ey;
            const V gt = load(r + x);
            // The derivatives of a, and those of the residual: constancy of the gradient.
            const V gxy = 0.25F * ((load(below + x + 1) - load(below + x - 1)) -
                                   (load(above + x + 1) - load(above + x - 1)));
            const V twice = 2.0F * load(here + x);
            const V ax = (load(here + x + 1) - twice + load(here + x - 1)) * ex + gxy * ey;
            const V ay = gxy * ex + (load(below + x) - twice + load(above + x)) * ey;
            const V xt = 0.5F * (load(r + x + 1) - load(r + x - 1));
            const V yt = 0.5F * (load(r_below + x) - load(r_above + x));
            store(out[0] + x, a * a + t.gamma * (ax * ax + ay * ay));
            store(out[1] + x, a * gt + t.gamma * (ax * xt + ay * yt));
            store(out[2] + x, gt * gt + t.gamma * (xt * xt + yt * yt));
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            const V residual = convolve_horizontal(line[2] + x, taps, radius);
            const V psi = 1.0F / sqrt(residual + t.epsilon2);
            add(t.sum11.row(y) + x, psi * convolve_horizontal(line[0] + x, taps, radius), reset);
            add(t.sum13.row(y) + x, psi * convolve_horizontal(line[1] + x, taps, radius), reset);
          }
        });
  });
}

void view_costs(const ViewGeometry& view, const ViewCosts& c, bool reset, int first, int last) {
  const auto right = static_cast<float>(c.first.width - 1);
  const auto bottom = static_cast<float>(c.first.height - 1);
  for (int y = first; y < last; ++y) {
    const Row row(view, y);
    for (int x = 0; x < padded(c.first.width); x += kLanes) {
      const V u = ramp() + static_cast<float>(x);
      const V grey = load(c.first.row(y) + x);
      const V own = load(c.distance[0].row(y) + x);
      const auto cost_of = [&](V d, I needed, V& cost, V& count) {
        const Point at = row.at(u, d);
        const V inside_x = clamp(at.x, 0, right);
        const V inside_y = clamp(at.y, 0, bottom);
        const I inside = at.used & I(inside_x == at.x) & I(inside_y == at.y);
        const V there = bilinear(c.second.data, c.second.stride, inside_x, inside_y, inside & needed);
        const V r = abs(there - grey);
        cost = select(inside, min(r, set(kTruncated)), V{});
        count = select(inside, set(1.0F), V{});
      };
      V cost[ViewCosts::kRivals];
      V count[ViewCosts::kRivals];
      cost_of(own, set(-1), cost[0], count[0]);
      for (int i = 1; i < ViewCosts::kRivals; ++i) {
        const V d = load(c.distance[i].row(y) + x);
        const I same = I(abs(d - own) <= c.same);
        cost[i] = cost[0];
        count[i] = count[0];
        if (all(same)) continue;
        V other;
        V seen;
        cost_of(d, ~same, other, seen);
        cost[i] = select(same, cost[0], other);
        count[i] = select(same, count[0], seen);
      }
      for (int i = 0; i < ViewCosts::kRivals; ++i) {
        add(c.cost[i].row(y) + x, cost[i], reset);
        add(c.count[i].row(y) + x, count[i], reset);
      }
    }
  }
}

long evidence_scratch(int radius, int width) {
  return window_scratch(kChannels, radius, width) + Lines<5>::floats(width) + Warped<false>::floats(width);
}

void view_evidence(const ViewGeometry& view, const ViewEvidence& e, bool reset, int first, int last,
                   float* scratch) {
  const int width = e.first.width;
  const int n = padded(width);
  const int begin = first - e.radius < 0 ? 0 : first - e.radius;
  float* const lines = scratch + window_scratch(kChannels, e.radius, width);
  Lines<5> grey(e.first, lines, begin - 2);
  Warped<false> warped(view, e.first, e.second, e.distance, lines + Lines<5>::floats(width), begin - 1);
  with_radius(e.radius, [&](auto radius) {
    windowed<kChannels>(
        first, last, width, e.first.height, e.taps, radius, scratch,
        [&](int y, float* const* out) {
          grey.advance(y + 2);
          warped.advance(y + 1);
          const float* const residual = warped.residual(y);
          const float* const above = warped.residual(y - 1);
          const float* const below = warped.residual(y + 1);
          const float* const along_x_of = warped.along_x(y);
          const float* const along_y_of = warped.along_y(y);
          for (int x = 0; x < n; x += kLanes) {
            const V gx = along_x(grey[y] + x);
            const V gy = five_point(load(grey[y - 2] + x), load(grey[y - 1] + x), load(grey[y + 1] + x),
                                    load(grey[y + 2] + x));
            const V ex = load(along_x_of + x);
            const V ey = load(along_y_of + x);
            const V a = gx * ex + gy * ey;
            const V r = load(residual + x);
            const V rx = 0.5F * (load(residual + x + 1) - load(residual + x - 1));
            const V ry = 0.5F * (load(below + x) - load(above + x));
            const V along = rx * ex + ry * ey;
            store(out[0] + x, a * a);
            store(out[1] + x, a * r);
            store(out[2] + x, r);
            store(out[3] + x, r * r);
            store(out[4] + x, along * along);
            store(out[5] + x, a * a * load(e.distance.row(y) + x));
          }
        },
        [&](int y, float* const* line, const float* taps) {
          const Row row(view, y);
          const auto right = static_cast<float>(width - 1);
          const auto bottom = static_cast<float>(e.first.height - 1);
          for (int x = 0; x < n; x += kLanes) {
            V sum[kChannels];
            for (int c = 0; c < kChannels; ++c) sum[c] = convolve_horizontal(line[c] + x, taps, radius);
            const V u = ramp() + static_cast<float>(x);
            const V d = load(e.distance.row(y) + x);
            const Point at = row.at(u, d);
            const I seen = at.used & I(at.x >= 0.0F) & I(at.y >= 0.0F) & I(at.x <= right) & I(at.y <= bottom);
            const V dx = at.x - u;
            const V dy = at.y - static_cast<float>(y);
            const V limit = set(kWrong) + set(kSlack) / (1.0F + sqrt(dx * dx + dy * dy));
            const V ex = row.along_x(at);
            const V ey = row.along_y(at);
            const V ee = ex * ex + ey * ey;
            const V noise2 = e.noise * e.noise * ee;
            const I good = seen & ~I(sum[4] - noise2 > limit * (2.0F * sum[0] + noise2));
            // Texture is what noise cannot be, as far as the residual shows it on the spot.
            const I texture = good & I(sum[0] > kSlopeNoise * max(sum[4], kLeastNoise2 * ee));
            const V variance = max(sum[3] - sum[2] * sum[2], set(e.noise * e.noise));
            const V information = select(texture, e.effective_size * sum[0] / variance, V{});
            const V per_energy = 1.0F / max(sum[0], set(1e-9F));
            const V step = -sum[1] * per_energy;
            add(e.offset.row(y) + x, information * (sum[5] * per_energy - d), reset);
            add(e.information.row(y) + x, information, reset);
            add(e.step.row(y) + x, information * step, reset);
            add(e.step2.row(y) + x, information * step * step, reset);
            add(e.matching.row(y) + x, select(good, set(1.0F), V{}), reset);
            const V per_ee = 1.0F / max(ee, set(1e-9F));
            add(e.texture.row(y) + x, select(good, sum[0] * per_ee, V{}), reset);
            add(e.left.row(y) + x, select(good, sum[4] * per_ee, V{}), reset);
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA
