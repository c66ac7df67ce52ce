// What the flow kernels add to core/vec.hpp: fetches from planes, windows, convolutions.
#pragma once

#include "pade/core/compute/vec.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow::PADE_ISA {

using simd::PADE_ISA::abs;
using simd::PADE_ISA::all;
using simd::PADE_ISA::clamp;
using simd::PADE_ISA::gather;
using simd::PADE_ISA::gather_pairs;
using simd::PADE_ISA::I;
using simd::PADE_ISA::kLanes;
using simd::PADE_ISA::kPicks;
using simd::PADE_ISA::load;
using simd::PADE_ISA::max;
using simd::PADE_ISA::min;
using simd::PADE_ISA::pick;
using simd::PADE_ISA::ramp;
using simd::PADE_ISA::select;
using simd::PADE_ISA::set;
using simd::PADE_ISA::sqrt;
using simd::PADE_ISA::store;
using simd::PADE_ISA::to_float;
using simd::PADE_ISA::truncate;
using simd::PADE_ISA::V;

static_assert(kRowMultiple % (2 * kLanes) == 0);

inline constexpr int kOffsets = kLanes - 1;  // bits of an index into a vector

// out[i] = planes[i][at] where `needed`, by plain loads in place of slow gathers; false where `at` does not
// allow that. Flow is smooth: most indices lie in the window of kLanes neighbours that begins with the first
// one, or in that which ends with the last one. Planes have a spare row behind their end.
template <int kCount>
PADE_INLINE bool fetch_near(const float* const (&planes)[kCount], I at, I needed, V (&out)[kCount]) {
  const int from_first = at[0];
  if constexpr (kPicks) {
    const int from_last = at[kLanes - 1] - kOffsets;
    const I in_first = at - from_first;
    const I in_last = at - from_last;
    const I first_has = (in_first & ~kOffsets) == 0;
    const I last_has = (in_last & ~kOffsets) == 0;
    // No branch between one window and two: which of them it is cannot be foretold, and costs more than a
    // load.
    if (!(from_last >= 0 && all(first_has | last_has | ~needed))) return false;
    for (int i = 0; i < kCount; ++i) {
      out[i] = select(first_has, pick(load(planes[i] + from_first), in_first),
                      pick(load(planes[i] + from_last), in_last));
    }
    return true;
  }
  // Without pick(): indices that count up by one, or jump once in between.
  const I start = at - truncate(ramp());
  const I like_first = start == from_first;
  const int from_last = start[kLanes - 1];
  if (!(from_last >= 0 && all(like_first | (start == from_last)))) return false;
  for (int i = 0; i < kCount; ++i)
    out[i] = select(like_first, load(planes[i] + from_first), load(planes[i] + from_last));
  return true;
}

// out[i] = planes[i][at].
template <int kCount>
PADE_INLINE void fetch(const float* const (&planes)[kCount], I at, V (&out)[kCount]) {
  if (fetch_near(planes, at, set(-1), out)) return;
  for (int i = 0; i < kCount; ++i) out[i] = gather(planes[i], at);
}

// The bilinear value of a plane at (x, y), which must lie in [0, width - 1] x [0, height - 1]; any value
// where it is not `needed`. Rows have a spare element behind their end and planes a spare row, so that the
// far corner needs no test.
PADE_INLINE V bilinear(const float* plane, int stride, V x, V y, I needed) {
  const I ix = truncate(x);
  const I iy = truncate(y);
  const V ax = x - to_float(ix);
  const V ay = y - to_float(iy);
  const I at = iy * stride + ix;
  const float* const corners[4] = {plane, plane + 1, plane + stride, plane + stride + 1};
  V v[4];
  if (!fetch_near(corners, at, needed, v)) {
    gather_pairs(plane, at, v[0], v[1]);
    gather_pairs(plane + stride, at, v[2], v[3]);
  }
  const V top = v[0] + ax * (v[1] - v[0]);
  const V bottom = v[2] + ax * (v[3] - v[2]);
  return top + ay * (bottom - top);
}
PADE_INLINE V bilinear(const float* plane, int stride, V x, V y) {
  return bilinear(plane, stride, x, y, set(-1));
}

// A window's radius that the compiler knows, so that loops over taps unroll and taps stay in registers.
template <int kValue>
struct Fixed {
  constexpr operator int() const { return kValue; }  // NOLINT(google-explicit-constructor): it is an int
};

// Calls work(radius) with the radii of the methods' own windows as constants, others as they are.
template <class Work>
PADE_INLINE void with_radius(int radius, const Work& work) {
  switch (radius) {
    case 1:
      return work(Fixed<1>());
    case 3:
      return work(Fixed<3>());
    case 4:
      return work(Fixed<4>());
    case 5:
      return work(Fixed<5>());
    case 8:
      return work(Fixed<8>());
    default:
      return work(radius);
  }
}

// out = sum of taps[|i|] * rows[i], i = -radius to radius; `rows` points at the middle row's pointer.
template <class Radius>
PADE_INLINE void convolve_vertical(const float* const* rows, const float* taps, Radius radius, float* out,
                                   int n) {
  constexpr int kBlock = 2;
  for (int x = 0; x < n; x += kBlock * kLanes) {
    V sum[kBlock];
    for (int b = 0; b < kBlock; ++b) sum[b] = taps[0] * load(rows[0] + x + b * kLanes);
    for (int i = 1; i <= radius; ++i) {
      for (int b = 0; b < kBlock; ++b) {
        sum[b] += taps[i] * (load(rows[-i] + x + b * kLanes) + load(rows[i] + x + b * kLanes));
      }
    }
    for (int b = 0; b < kBlock; ++b) store(out + x + b * kLanes, sum[b]);
  }
}

// The value at x of a row convolved with symmetric taps; reads `radius` elements to both sides.
template <class Radius>
PADE_INLINE V convolve_horizontal(const float* row, const float* taps, Radius radius) {
  V sum = taps[0] * load(row);
  for (int i = 1; i <= radius; ++i) sum += taps[i] * (load(row - i) + load(row + i));
  return sum;
}

// Every other element of two neighbouring vectors, and back.
#if defined(__AVX512F__)
PADE_INLINE V even(V a, V b) {
  return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
}
PADE_INLINE V odd(V a, V b) {
  return __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
}
PADE_INLINE V zip_low(V a, V b) {
  return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
}
PADE_INLINE V zip_high(V a, V b) {
  return __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
}
#elif defined(__AVX2__)
PADE_INLINE V even(V a, V b) { return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14); }
PADE_INLINE V odd(V a, V b) { return __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15); }
PADE_INLINE V zip_low(V a, V b) { return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11); }
PADE_INLINE V zip_high(V a, V b) { return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15); }
#else
PADE_INLINE V even(V a, V b) { return __builtin_shufflevector(a, b, 0, 2, 4, 6); }
PADE_INLINE V odd(V a, V b) { return __builtin_shufflevector(a, b, 1, 3, 5, 7); }
PADE_INLINE V zip_low(V a, V b) { return __builtin_shufflevector(a, b, 0, 4, 1, 5); }
PADE_INLINE V zip_high(V a, V b) { return __builtin_shufflevector(a, b, 2, 6, 3, 7); }
#endif

}  // namespace pade::flow::PADE_ISA
