// PADE per pixel (Eq. 1 and 2 with the errata of docs/method.md). Every branch is a selection, so that the
// loop vectorises; R - I instead of R keeps the difference D free of cancellation in single precision.
#include "pade/depth/depth_kernel.hpp"

#ifndef PADE_ISA
#define PADE_ISA baseline
#endif

namespace pade::depth::PADE_ISA {
namespace {

// Values of DepthState; core/depth_image.hpp is too heavy for a kernel (held together by a static_assert
// there).
constexpr std::int32_t kMeasured = 0;
constexpr std::int32_t kEpipole = 1;
constexpr std::int32_t kLowParallax = 2;
constexpr std::int32_t kNoTexture = 3;
constexpr std::int32_t kInconsistent = 4;
constexpr std::int32_t kOutOfView = 5;
constexpr std::int32_t kFar = 6;

// Where |a| is not this many sigmas of itself, its direction is not known either: flow in any direction may
// be parallax.
constexpr float kDirectionSigmas2 = 36.0F;

struct Vector2 {
  float x, y;
};

/// (I + T) (p / f, 1), projected: what is added to pixel p.
[[gnu::always_inline]] inline Vector2 turned_shift(const float* t, const KernelParameters& k, float px,
                                                   float py) {
  const float rx = px * k.inverse_fx;
  const float ry = py * k.inverse_fy;
  const float ex = t[0] * rx + t[1] * ry + t[2];
  const float ey = t[3] * rx + t[4] * ry + t[5];
  const float ez = t[6] * rx + t[7] * ry + t[8];
  const float z = 1.0F + ez;
  // A direction turned behind the image plane has no pixel: NaN makes every later test fail.
  const float inverse = z > 0.0F ? 1.0F / z : __builtin_nanf("");
  return {(k.fx * ex - px * ez) * inverse, (k.fy * ey - py * ez) * inverse};
}

/// What the covariance Sigma of the motion does to a pixel.
struct PoseEffect {
  float depth;     ///< J Sigma J^T of the depth, m^2
  float parallax;  ///< of D along a, through the rotation, px^2
  float reach;     ///< of |a|, in the direction in which it is greatest, px^2 m^2
};

/// J = [s a^T(-A)/|a|^2 + (0,0,1), s^2 a^T B(x2) / |a|^2].
[[gnu::always_inline]] inline PoseEffect pose_effect(const KernelParameters& k, float x, float y, Vector2 at,
                                                     float ax, float ay, float inverse_aa, float s,
                                                     bool has_z) {
  const float g = s * inverse_aa;
  const float h = s * g;
  const float x2 = x + at.x;
  const float y2 = y + at.y;
  const float bx = ax * k.fx;
  const float by = ay * k.fy;
  const float u = x2 * k.inverse_fx;
  const float v = y2 * k.inverse_fy;
  const float j[6] = {-g * bx,
                      -g * by,
                      g * (ax * x + ay * y) + (has_z ? 1.0F : 0.0F),
                      -h * (bx * (-u * v) + by * (-1.0F - v * v)),
                      -h * (bx * (1.0F + u * u) + by * (u * v)),
                      -h * (bx * -v + by * u)};
  const float b[3] = {bx * (-u * v) + by * (-1.0F - v * v), bx * (1.0F + u * u) + by * (u * v),
                      bx * -v + by * u};
  PoseEffect effect{0, 0, 0};
  int index = 0;
#pragma GCC unroll 6
  for (int r = 0; r < 6; ++r) {
#pragma GCC unroll 6
    for (int c = r; c < 6; ++c) {
      const float covariance = (r == c ? 1.0F : 2.0F) * k.pose[index++];
      effect.depth += covariance * j[r] * j[c];
      if (r >= 3) effect.parallax += covariance * b[r - 3] * b[c - 3];
    }
  }
  effect.parallax *= inverse_aa;
  // The trace of A Sigma_t A^T, no less than its greatest eigenvalue.
  effect.reach = k.fx * k.fx * k.pose[0] + k.fy * k.fy * k.pose[6] - 2.0F * k.fx * x * k.pose[2] -
                 2.0F * k.fy * y * k.pose[7] + (x * x + y * y) * k.pose[11];
  return effect;
}

/// The derotated flow D (or d) of a pixel, and where its match lies in the other image.
struct Derotated {
  Vector2 d, match;
};

template <KernelDerotation kDerotation>
[[gnu::always_inline]] inline Derotated derotated(const KernelParameters& k, float x, float y, float wx,
                                                  float wy) {
  Vector2 d{wx, wy};
  Vector2 match{x + wx, y + wy};
  if constexpr (kDerotation == KernelDerotation::none) {
    const Vector2 shift = turned_shift(k.view, k, match.x, match.y);
    match = {match.x + shift.x, match.y + shift.y};
  } else if constexpr (kDerotation == KernelDerotation::exact) {
    const Vector2 shift = turned_shift(k.turn, k, match.x, match.y);
    d = {wx + shift.x, wy + shift.y};
  } else if constexpr (kDerotation == KernelDerotation::remaining) {
    const Vector2 left = turned_shift(k.turn, k, match.x, match.y);
    d = {wx + left.x, wy + left.y};
    const Vector2 shift = turned_shift(k.view, k, match.x, match.y);
    match = {match.x + shift.x, match.y + shift.y};
  } else {
    const float u = x * k.inverse_fx;
    const float v = y * k.inverse_fy;
    d.x = wx + k.fx * (-u * v * k.omega[0] + (1.0F + u * u) * k.omega[1] - v * k.omega[2]);
    d.y = wy + k.fy * (-(1.0F + v * v) * k.omega[0] + u * v * k.omega[1] + u * k.omega[2]);
  }
  return {d, match};
}

/// `yes` where all bits of `mask` are set, `no` where none is.
[[gnu::always_inline]] inline float chosen(std::int32_t mask, float yes, float no) {
  return __builtin_bit_cast(
      float, (__builtin_bit_cast(std::int32_t, yes) & mask) | (__builtin_bit_cast(std::int32_t, no) & ~mask));
}

/// What a pixel is judged by.
struct Evidence {
  float z, aa, ad, sigma2;
  bool inside;     ///< the match lies in the other image
  bool parallax;   ///< enough of it for its noise
  bool across_ok;  ///< the flow across the epipolar line is noise
  bool has_flow;
};

/// State of a pixel: the strongest reason against it, from the weakest on.
[[gnu::always_inline]] inline std::int32_t state_of(const KernelParameters& k, const Evidence& e,
                                                    std::uint8_t gate) {
  const bool in_front = (e.ad > 0.0F) & (e.z > 0.0F);
  const std::int32_t low = e.aa < k.epipole2 ? kEpipole : kLowParallax;
  std::int32_t why = kMeasured;
  why = e.z <= k.range ? why : kLowParallax;
  why = in_front ? why : kInconsistent;
  why = e.parallax ? why : low;
  why = e.across_ok ? why : kInconsistent;
  why = e.has_flow & (e.sigma2 < 1e6F) ? why : kInconsistent;
  why = e.inside ? why : kOutOfView;
  why = gate == kNoTexture ? kNoTexture : why;
  why = e.aa >= k.blind2 ? why : low;
  return gate == kOutOfView ? kOutOfView : why;
}

/// The lower bound: the least |a| over the greatest parallax that are still likely; NaN where none is known.
[[gnu::always_inline]] inline float bound_of(const KernelParameters& k, const Evidence& e,
                                             const PoseEffect& pose, float d2, std::uint8_t gate) {
  const float reach = __builtin_sqrtf(e.aa);
  const bool directed = e.aa >= kDirectionSigmas2 * pose.reach;
  const float along = e.ad / reach;
  const float seen = directed ? (along > 0.0F ? along : 0.0F) : __builtin_sqrtf(d2);
  const float least = reach - k.bound_k * __builtin_sqrtf(pose.reach);
  const float most = seen + k.bound_k * __builtin_sqrtf(e.sigma2 + pose.parallax);
  const float nothing_before = least / most + k.add_tz;
  const bool behind = directed & (e.ad < 0.0F) & e.parallax;
  const bool bounded = (gate == 0) & e.inside & (e.across_ok | !directed) & !behind & (e.sigma2 < 1e6F) &
                       (least > 0.0F) & (nothing_before > 0.0F);
  return bounded ? nothing_before : __builtin_nanf("");
}

/// Only what decides most of the work is a constant; what chooses between two numbers costs nothing in the
/// loop.
template <KernelDerotation kDerotation, bool kPose>
void row(const KernelParameters& parameters, const float* __restrict x_of, const float y,
         const float* __restrict flow, const float* __restrict sigma_of, const std::uint8_t* __restrict gate,
         std::size_t count, float* __restrict depth, float* __restrict variance,
         float* __restrict own_variance, float* __restrict bounds, std::uint8_t* __restrict state) {
  const KernelParameters k = parameters;  // a copy that no store through the outputs can change
  const float nan = __builtin_nanf("");
  // Conditions in the loop would keep it from being vectorised: numbers and bits choose instead.
  const float* const sigma = sigma_of != nullptr ? sigma_of : x_of;  // in place of none any finite numbers
  const float scale2 = sigma_of != nullptr ? k.sigma_scale2 : 0.0F;
  const float constant2 = sigma_of != nullptr ? 0.0F : k.sigma2;
  const std::int32_t samelson = k.samelson ? -1 : 0;
#pragma GCC ivdep  // five outputs and four inputs: more than the compiler would check for overlap
  for (std::size_t i = 0; i < count; ++i) {
    const float x = x_of[i];
    const float wx = flow[2 * i];
    const float wy = flow[2 * i + 1];
    // a = -A t
    const float ax = x * k.tz - k.fx_tx;
    const float ay = y * k.tz - k.fy_ty;
    const auto [d, match] = derotated<kDerotation>(k, x, y, wx, wy);

    const float aa = ax * ax + ay * ay;
    const float ad = ax * d.x + ay * d.y;
    const float across = ax * d.y - ay * d.x;
    const float d2 = d.x * d.x + d.y * d.y;
    const float s = chosen(samelson, ad, aa) / chosen(samelson, d2, ad);
    const float sigma2 = (scale2 * sigma[i] * sigma[i] + constant2) + k.relative2 * d2;
    const float ad2 = ad * ad;
    const float noise = sigma2 * aa;
    const bool inside =
        (match.x >= k.left) & (match.x <= k.right) & (match.y >= k.top) & (match.y <= k.bottom);
    const bool parallax = ad2 > k.parallax2 * noise;
    const bool across_ok = (across * across <= k.residual2 * noise) | (across * across <= k.tangent2 * ad2);
    const bool has_flow = (wx == wx) & (wy == wy);
    const Evidence e = {s + k.add_tz, aa, ad, sigma2, inside, parallax, across_ok, has_flow};

    const float inverse_aa = 1.0F / aa;
    // 1/Z has a symmetric error, Z has not: mean squared error under a log-uniform prior on depth, with
    // e2 = (sigma / parallax)^2 (docs/method.md; held to the integral by a test).
    const float e2 = noise / ad2;
    const float second_order = 1.0F + e2 * (18.0F + 400.0F * e2);
    const float spread = s * s * (s * s * sigma2 * second_order + k.axis_variance) * inverse_aa;
    PoseEffect pose{0, 0, k.axis_variance};
    if constexpr (kPose) {
      pose = pose_effect(k, x, y, d, ax, ay, inverse_aa, s, k.add_tz != 0.0F);
      pose.reach += k.axis_variance;
    }

    const float bound = bound_of(k, e, pose, d2, gate[i]);
    std::int32_t why = state_of(k, e, gate[i]);
    why = (why == kLowParallax) & (bound >= k.range) ? kFar : why;

    depth[i] = why == kMeasured ? e.z : nan;
    own_variance[i] = why == kMeasured ? spread : nan;
    variance[i] = why == kMeasured ? spread + pose.depth : nan;
    bounds[i] = bound;
    state[i] = static_cast<std::uint8_t>(why);
  }
}

template <KernelDerotation kDerotation, class... Rest>
void choose(const KernelParameters& k, const Rest&... rest) {
  k.has_pose ? row<kDerotation, true>(k, rest...) : row<kDerotation, false>(k, rest...);
}

/// kN > 0: a constant number of neighbours, which vectorises.
template <int kN>
void sum_whole_windows(const float* __restrict in, std::size_t windows, int n, float* __restrict out) {
  for (std::size_t c = 0; c < windows; ++c) {
    const int count = kN > 0 ? kN : n;
    const float* const first = in + c * static_cast<std::size_t>(count);
    float sum = 0;
    for (int i = 0; i < count; ++i) sum += first[i];
    out[c] = sum;
  }
}

}  // namespace

void depth_row(const KernelParameters& k, const float* x, float y, const float* flow, const float* sigma,
               const std::uint8_t* gate, std::size_t count, const DepthRow& out) {
  switch (k.derotation) {
    case KernelDerotation::none:
      return choose<KernelDerotation::none>(k, x, y, flow, sigma, gate, count, out.depth, out.variance,
                                            out.own_variance, out.bound, out.state);
    case KernelDerotation::exact:
      return choose<KernelDerotation::exact>(k, x, y, flow, sigma, gate, count, out.depth, out.variance,
                                             out.own_variance, out.bound, out.state);
    case KernelDerotation::first_order:
      return choose<KernelDerotation::first_order>(k, x, y, flow, sigma, gate, count, out.depth, out.variance,
                                                   out.own_variance, out.bound, out.state);
    case KernelDerotation::remaining:
      return choose<KernelDerotation::remaining>(k, x, y, flow, sigma, gate, count, out.depth, out.variance,
                                                 out.own_variance, out.bound, out.state);
  }
}

void accumulate_flow_row(const float* __restrict flow, const std::uint8_t* __restrict gate, std::size_t count,
                         float* __restrict sum_u, float* __restrict sum_v, float* __restrict valid) {
  for (std::size_t i = 0; i < count; ++i) {
    const float u = flow[2 * i];
    const float v = flow[2 * i + 1];
    const bool use = (u == u) & (v == v) & (gate[i] == 0);
    sum_u[i] += use ? u : 0.0F;
    sum_v[i] += use ? v : 0.0F;
    valid[i] += use ? 1.0F : 0.0F;
  }
}

void sum_columns(const float* in, std::size_t width, int n, float* out) {
  const std::size_t whole = width / static_cast<std::size_t>(n);
  switch (n) {
    case 2:
      sum_whole_windows<2>(in, whole, n, out);
      break;
    case 4:
      sum_whole_windows<4>(in, whole, n, out);
      break;
    case 8:
      sum_whole_windows<8>(in, whole, n, out);
      break;
    default:
      sum_whole_windows<0>(in, whole, n, out);
  }
  const std::size_t rest = whole * static_cast<std::size_t>(n);
  if (rest < width) sum_whole_windows<0>(in + rest, 1, static_cast<int>(width - rest), out + whole);
}

void mean_flow(const float* __restrict sum_u, const float* __restrict sum_v, const float* __restrict valid,
               std::size_t count, float* __restrict mean, std::uint8_t* __restrict empty) {
  for (std::size_t i = 0; i < count; ++i) {
    const float share = 1.0F / valid[i];
    mean[2 * i] = sum_u[i] * share;  // 0 * (1 / 0) is NaN: no flow
    mean[2 * i + 1] = sum_v[i] * share;
    empty[i] = valid[i] > 0.0F ? 0 : 1;
  }
}

void accumulate_gradients(const std::int16_t* __restrict gx, const std::int16_t* __restrict gy,
                          std::size_t count, std::int32_t* __restrict xx, std::int32_t* __restrict xy,
                          std::int32_t* __restrict yy) {
  for (std::size_t i = 0; i < count; ++i) {
    xx[i] += gx[i] * gx[i];
    xy[i] += gx[i] * gy[i];
    yy[i] += gy[i] * gy[i];
  }
}

}  // namespace pade::depth::PADE_ISA
