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
constexpr float kNoiseGradients = 2.0F;
// Squared slopes, per grey^2 of noise, that are no texture: noise alone makes 0.9.
constexpr float kSlopeNoise = 1.5F;
constexpr float kTruncated = 20;  // grey values: farther off is as wrong
constexpr int kChannels = 6;
constexpr int kMatchedRows = 3;

long matched_line(int width) { return padded(width) + 2L * kRowMultiple; }

struct Seen {
  V x, y;    // where the view sees the pixels
  I inside;  // of its image, and used

  [[gnu::always_inline]] Seen(const ViewEvidence& e, int from_x, int from_y) {
    const V ex = load(e.line.direction_x.row(from_y) + from_x);
    const V ey = load(e.line.direction_y.row(from_y) + from_x);
    const V d = load(e.distance.row(from_y) + from_x);
    x = load(e.line.base_u.row(from_y) + from_x) + d * ex + (ramp() + static_cast<float>(from_x));
    y = load(e.line.base_v.row(from_y) + from_x) + d * ey + static_cast<float>(from_y);
    inside = I(x >= 0.0F) & I(y >= 0.0F) & I(x <= static_cast<float>(e.first.width - 1)) &
             I(y <= static_cast<float>(e.first.height - 1)) & I(ex * ex + ey * ey > 0.0F);
  }
};

// second(p') - first(p), row by row.
class Residual {
 public:
  Residual(const ViewEvidence& evidence, float* scratch, int first)
      : e_(evidence), memory_(scratch), done_(first < 0 ? 0 : first) {}
  static long floats(int width) { return kMatchedRows * matched_line(width); }

  template <class Grey>
  void advance(int last, const Grey& grey) {
    const int width = e_.first.width;
    const auto right = static_cast<float>(width - 1);
    const auto bottom = static_cast<float>(e_.first.height - 1);
    for (; done_ <= last && done_ < e_.first.height; ++done_) {
      float* const line = slot(done_);
      for (int x = 0; x < padded(width); x += kLanes) {
        const Seen at(e_, x, done_);
        const V warped =
            bilinear(e_.second.data, e_.second.stride, clamp(at.x, 0, right), clamp(at.y, 0, bottom));
        store(line + x, warped - load(grey[done_] + x));
      }
      repeat_edges(line, width, 1);
    }
  }
  const float* operator[](int y) const { return slot(clamp_index(y, e_.first.height)); }

 private:
  float* slot(int y) const {
    return memory_ + (y % kMatchedRows) * matched_line(e_.first.width) + kRowMultiple;
  }
  const ViewEvidence& e_;
  float* memory_;
  int done_;
};

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
    Point p;
    p.per_z = 1.0F / z;
    p.x = (hx + d * g.e[0]) * p.per_z;
    p.y = (hy + d * g.e[1]) * p.per_z;
    const V per_hz = 1.0F / hz;
    const V px = p.x - hx * per_hz;
    const V py = p.y - hy * per_hz;
    p.used = I(hz > 0.0F) & I(z > least_z * hz) & I(z < g.largest_scale * hz) &
             I(px * px + py * py <= g.largest_parallax2);
    return p;
  }
};

}  // namespace

void view_lines(const ViewGeometry& view, PlaneView distance, const EpipolarLevel& line, int first,
                int last) {
  for (int y = first; y < last; ++y) {
    const Row row(view, y);
    for (int x = 0; x < padded(distance.width); x += kLanes) {
      const V u = ramp() + static_cast<float>(x);
      const V d = load(distance.row(y) + x);
      const Point at = row.at(u, d);
      const V dx = (row.g.e[0] - at.x * row.g.e[2]) * at.per_z;
      const V dy = (row.g.e[1] - at.y * row.g.e[2]) * at.per_z;
      store(line.direction_x.row(y) + x, select(at.used, dx, V{}));
      store(line.direction_y.row(y) + x, select(at.used, dy, V{}));
      store(line.base_u.row(y) + x, select(at.used, at.x - u - d * dx, V{}));
      store(line.base_v.row(y) + x, select(at.used, at.y - row.v - d * dy, V{}));
    }
  }
}

void view_cost(const ViewGeometry& view, PlaneView reference, PlaneView seen, PlaneView distance,
               PlaneView cost, PlaneView count, bool reset, int first, int last) {
  const auto right = static_cast<float>(distance.width - 1);
  const auto bottom = static_cast<float>(distance.height - 1);
  for (int y = first; y < last; ++y) {
    const Row row(view, y);
    for (int x = 0; x < padded(distance.width); x += kLanes) {
      const Point at = row.at(ramp() + static_cast<float>(x), load(distance.row(y) + x));
      const V inside_x = clamp(at.x, 0, right);
      const V inside_y = clamp(at.y, 0, bottom);
      const I inside = at.used & I(inside_x == at.x) & I(inside_y == at.y);
      const V r = abs(bilinear(seen.data, seen.stride, inside_x, inside_y) - load(reference.row(y) + x));
      add(cost.row(y) + x, select(inside, min(r, set(kTruncated)), V{}), reset);
      add(count.row(y) + x, select(inside, set(1.0F), V{}), reset);
    }
  }
}

void view_add(const ViewTensor& t, bool reset, int first, int last) {
  for (int y = first; y < last; ++y) {
    for (int x = 0; x < padded(t.j11.width); x += kLanes) {
      const V psi = 1.0F / sqrt(load(t.j33.row(y) + x) + t.epsilon2);
      add(t.sum11.row(y) + x, psi * load(t.j11.row(y) + x), reset);
      add(t.sum13.row(y) + x, psi * load(t.j13.row(y) + x), reset);
    }
  }
}

long evidence_scratch(int radius, int width) {
  return window_scratch(kChannels, radius, width) + Lines<5>::floats(width) + Residual::floats(width);
}

void view_evidence(const ViewEvidence& e, bool reset, int first, int last, float* scratch) {
  const int width = e.first.width;
  const int n = padded(width);
  const int begin = first - e.radius < 0 ? 0 : first - e.radius;
  float* const lines = scratch + window_scratch(kChannels, e.radius, width);
  Lines<5> grey(e.first, lines, begin - 2);
  Residual residual(e, lines + Lines<5>::floats(width), begin - 1);
  with_radius(e.radius, [&](auto radius) {
    windowed<kChannels>(
        first, last, width, e.first.height, e.taps, radius, scratch,
        [&](int y, float* const* out) {
          grey.advance(y + 2);
          residual.advance(y + 1, grey);
          for (int x = 0; x < n; x += kLanes) {
            const V gx = along_x(grey[y] + x);
            const V gy = five_point(load(grey[y - 2] + x), load(grey[y - 1] + x), load(grey[y + 1] + x),
                                    load(grey[y + 2] + x));
            const V a = gx * load(e.line.direction_x.row(y) + x) + gy * load(e.line.direction_y.row(y) + x);
            const V r = load(residual[y] + x);
            const V rx = 0.5F * (load(residual[y] + x + 1) - load(residual[y] + x - 1));
            const V ry = 0.5F * (load(residual[y + 1] + x) - load(residual[y - 1] + x));
            store(out[0] + x, a * a);
            store(out[1] + x, a * r);
            store(out[2] + x, gx * gx + gy * gy);
            store(out[3] + x, r);
            store(out[4] + x, r * r);
            store(out[5] + x, rx * rx + ry * ry);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            V sum[kChannels];
            for (int c = 0; c < kChannels; ++c) sum[c] = convolve_horizontal(line[c] + x, taps, radius);
            const V variance = max(sum[4] - sum[3] * sum[3], set(e.noise * e.noise));
            const Seen at(e, x, y);
            const V dx = at.x - (ramp() + static_cast<float>(x));
            const V dy = at.y - static_cast<float>(y);
            const V noise2 = set(kNoiseGradients * e.noise * e.noise);
            const V limit = set(kWrong) + set(kSlack) / (1.0F + sqrt(dx * dx + dy * dy));
            const I bad = I(sum[5] - noise2 > limit * (2.0F * sum[2] + noise2));
            const I good = at.inside & ~bad;
            const V ex = load(e.line.direction_x.row(y) + x);
            const V ey = load(e.line.direction_y.row(y) + x);
            // Noise of the image, or more where the residual shows more.
            const V here = max(sum[5] / kNoiseGradients, set(e.image_noise * e.image_noise));
            const V of_noise = kSlopeNoise * here * (ex * ex + ey * ey);
            const I texture = I(sum[0] > of_noise);
            const V information = select(good & texture, e.effective_size * sum[0] / variance, V{});
            const V step = select(I(sum[0] > 0.0F), -sum[1] / max(sum[0], set(1e-9F)), V{});
            add(e.information.row(y) + x, information, reset);
            add(e.step.row(y) + x, information * step, reset);
            add(e.step2.row(y) + x, information * step * step, reset);
            add(e.matching.row(y) + x, select(good, set(1.0F), V{}), reset);
            add(e.wrong.row(y) + x, select(at.inside & bad, set(1.0F), V{}), reset);
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA
