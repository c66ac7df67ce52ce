#include "pade/depth/multi_view/start_kernel.hpp"

#include "pade/core/compute/vec.hpp"

#ifndef PADE_ISA
#define PADE_ISA baseline
#endif

namespace pade::depth::PADE_ISA {
namespace {

using namespace simd::PADE_ISA;

struct Bilinear {
  const float* values;
  int stride;
  float right, bottom;

  /// NaN outside.
  [[gnu::always_inline]] V at(V x, V y) const {
    const I inside = I(x >= 0.0F) & I(y >= 0.0F) & I(x < right) & I(y < bottom);
    const V safe_x = select(inside, x, V{});
    const V safe_y = select(inside, y, V{});
    const I ix = truncate(safe_x);
    const I iy = truncate(safe_y);
    const V ax = safe_x - to_float(ix);
    const V ay = safe_y - to_float(iy);
    const I index = iy * stride + ix;
    V a;
    V b;
    V c;
    V d;
    gather_pairs(values, index, a, b);
    gather_pairs(values + stride, index, c, d);
    const V above = a + ax * (b - a);
    const V below = c + ax * (d - c);
    return select(inside, above + ay * (below - above), set(__builtin_nanf("")));
  }
};

/// Inverse depth, here, of what the last frame saw where a point of inverse depth `rho` on the ray of (x, y)
/// was; NaN = it did not see it.
[[gnu::always_inline]] inline V look_up(const StartParameters& p, const Bilinear& last, V x, float y, V rho) {
  const V rx = (x - p.cx) / p.fx;
  const V ry = set((y - p.cy) / p.fy);
  const V ray_x = p.R[0] * rx + p.R[1] * ry + p.R[2];
  const V ray_y = p.R[3] * rx + p.R[4] * ry + p.R[5];
  const V ray_z = p.R[6] * rx + p.R[7] * ry + p.R[8];
  const V qz = ray_z + rho * p.t[2];
  const V per_z = 1.0F / qz;
  const V there =
      last.at(p.fx * (ray_x + rho * p.t[0]) * per_z + p.cx, p.fy * (ray_y + rho * p.t[1]) * per_z + p.cy);
  // Z_last = Z ray_z + t_z
  const V here = there * ray_z / (1.0F - there * p.t[2]);
  return select(I(qz > 0.0F) & I(here < p.most), here, set(__builtin_nanf("")));
}

[[gnu::always_inline]] inline V start(const StartParameters& p, const Bilinear& last, int from, int y,
                                      const float* depth, const float* flow) {
  const I two = 2 * truncate(ramp());
  const V x = ramp() + static_cast<float>(from);
  V wx;
  V wy;
  gather_pairs(flow + 2L * from, two, wx, wy);
  const V ax = (x - p.cx) * p.tz - p.fx_tx;
  const V ay = set((static_cast<float>(y) - p.cy) * p.tz - p.fy_ty);
  const V ad = ax * wx + ay * wy;
  const V reach = select(I(ad > 0.0F), ad / (ax * ax + ay * ay + p.damping), V{});  // of Z - t_z
  const V z = load(depth + from);
  V rho = select(I(z > 0.0F), 1.0F / z, reach / (1.0F + reach * p.tz));
  rho = select(I(rho >= 0.0F) & I(rho <= p.most), rho, V{});
  if (p.last == nullptr) return rho;
  const V found = look_up(p, last, x, static_cast<float>(y), rho);
  const I agrees = I(abs(found - rho) < p.agreement * max(found, rho) + p.slack);
  // A pair in which neither would be seen to move, and which has measured nothing, does not disagree.
  const I untold = ~I(z > 0.0F) & I(found < p.untold) & I(rho < p.untold);
  return select(agrees | untold, found, rho);
}

}  // namespace

void start_row(const StartParameters& p, int y, const float* depth, const float* flow, float* rho) {
  const Bilinear last{p.last, p.last_stride, static_cast<float>(p.width - 1),
                      static_cast<float>(p.height - 1)};
  if (p.width < kLanes) {
    float d[kLanes] = {};
    float w[2 * kLanes] = {};
    float out[kLanes];
    for (int x = 0; x < p.width; ++x) {
      d[x] = depth[x];
      w[2 * x] = flow[2 * x];
      w[2 * x + 1] = flow[2 * x + 1];
    }
    store(out, start(p, last, 0, y, d, w));
    for (int x = 0; x < p.width; ++x) rho[x] = out[x];
    return;
  }
  for (int x = 0; x + kLanes <= p.width; x += kLanes) store(rho + x, start(p, last, x, y, depth, flow));
  const int tail = p.width - kLanes;
  store(rho + tail, start(p, last, tail, y, depth, flow));
}

}  // namespace pade::depth::PADE_ISA
