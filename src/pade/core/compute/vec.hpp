// One SIMD vector of floats per instruction set, for kernel files only (compiled once per set, see
// cmake/PadeCompiler.cmake). Arithmetic is the compilers' vector extension, element-wise and never fused, so
// that every set gives the same bits; what the extension cannot say is here.
#pragma once

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#define PADE_INLINE [[gnu::always_inline]] static inline

namespace pade::simd::PADE_ISA {

#if defined(__AVX512F__)
inline constexpr int kLanes = 16;
#elif defined(__AVX2__)
inline constexpr int kLanes = 8;
#else
inline constexpr int kLanes = 4;
#endif

using V [[gnu::vector_size(4 * kLanes)]] = float;
using I [[gnu::vector_size(4 * kLanes)]] = int;

PADE_INLINE V load(const float* from) {
  V value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
PADE_INLINE void store(float* to, V value) { __builtin_memcpy(to, &value, sizeof value); }
PADE_INLINE V set(float value) { return value - V{}; }
PADE_INLINE I set(int value) { return value - I{}; }

// 0, 1, 2, ... as floats.
PADE_INLINE V ramp() {
#if defined(__AVX512F__)
  return V{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
#elif defined(__AVX2__)
  return V{0, 1, 2, 3, 4, 5, 6, 7};
#else
  return V{0, 1, 2, 3};
#endif
}

// min and max return the second operand if either is NaN, on every machine.
#if defined(__AVX512F__)
// The plain intrinsics of GCC 12 pass an uninitialised operand, which its own warnings refuse.
inline constexpr __mmask16 kAll = 0xffff;
PADE_INLINE V min(V a, V b) { return V(_mm512_maskz_min_ps(kAll, __m512(a), __m512(b))); }
PADE_INLINE V max(V a, V b) { return V(_mm512_maskz_max_ps(kAll, __m512(a), __m512(b))); }
PADE_INLINE V sqrt(V a) { return V(_mm512_maskz_sqrt_ps(kAll, __m512(a))); }
PADE_INLINE V gather(const float* base, I index) {
  return V(_mm512_mask_i32gather_ps(__m512{}, kAll, __m512i(index), base, 4));
}
#elif defined(__AVX2__)
PADE_INLINE V min(V a, V b) { return V(_mm256_min_ps(__m256(a), __m256(b))); }
PADE_INLINE V max(V a, V b) { return V(_mm256_max_ps(__m256(a), __m256(b))); }
PADE_INLINE V sqrt(V a) { return V(_mm256_sqrt_ps(__m256(a))); }
PADE_INLINE V gather(const float* base, I index) { return V(_mm256_i32gather_ps(base, __m256i(index), 4)); }
#elif defined(__SSE2__)
PADE_INLINE V min(V a, V b) { return V(_mm_min_ps(__m128(a), __m128(b))); }
PADE_INLINE V max(V a, V b) { return V(_mm_max_ps(__m128(a), __m128(b))); }
PADE_INLINE V sqrt(V a) { return V(_mm_sqrt_ps(__m128(a))); }
PADE_INLINE V gather(const float* base, I index) {
  return V{base[index[0]], base[index[1]], base[index[2]], base[index[3]]};
}
#else
PADE_INLINE V min(V a, V b) { return a < b ? a : b; }
PADE_INLINE V max(V a, V b) { return a > b ? a : b; }
PADE_INLINE V sqrt(V a) {
#if defined(__aarch64__)
  return V(vsqrtq_f32(float32x4_t(a)));
#else
  return V{__builtin_sqrtf(a[0]), __builtin_sqrtf(a[1]), __builtin_sqrtf(a[2]), __builtin_sqrtf(a[3])};
#endif
}
PADE_INLINE V gather(const float* base, I index) {
  return V{base[index[0]], base[index[1]], base[index[2]], base[index[3]]};
}
#endif

// first[i] = base[index[i]], second[i] = base[index[i] + 1]: half the fetches of two gathers.
PADE_INLINE void gather_pairs(const float* base, I index, V& first, V& second) {
#if defined(__AVX512F__)
  const auto fetch = [&](__m256i at) {
    return V(_mm512_mask_i32gather_pd(__m512d{}, __mmask8{0xff}, at, base, 4));
  };
  const auto low = fetch(__m256i(__builtin_shufflevector(index, index, 0, 1, 2, 3, 4, 5, 6, 7)));
  const auto high = fetch(__m256i(__builtin_shufflevector(index, index, 8, 9, 10, 11, 12, 13, 14, 15)));
  first = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  second = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
#elif defined(__AVX2__)
  const auto* pairs = reinterpret_cast<const double*>(base);
  // Ordered so that shuffles within halves put the lanes right.
  const I order = __builtin_shufflevector(index, index, 0, 1, 4, 5, 2, 3, 6, 7);
  // The plain intrinsic starts from an uninitialised operand, which GCC 12's own warnings refuse.
  const auto fetch = [&](__m128i at) {
    const __m256d every = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
    return V(_mm256_mask_i32gather_pd(_mm256_setzero_pd(), pairs, at, every, 4));
  };
  const V low = fetch(_mm256_castsi256_si128(__m256i(order)));
  const V high = fetch(_mm256_extracti128_si256(__m256i(order), 1));
  first = V(_mm256_shuffle_ps(__m256(low), __m256(high), 0x88));
  second = V(_mm256_shuffle_ps(__m256(low), __m256(high), 0xdd));
#elif defined(__aarch64__)
  const auto fetch = [&](int lane) { return vld1_f32(base + index[lane]); };
  const float32x4_t low = vcombine_f32(fetch(0), fetch(1));
  const float32x4_t high = vcombine_f32(fetch(2), fetch(3));
  first = V(vuzp1q_f32(low, high));
  second = V(vuzp2q_f32(low, high));
#else
  first = gather(base, index);
  second = gather(base + 1, index);
#endif
}

// Whether pick() is one instruction.
#if defined(__AVX2__)
inline constexpr bool kPicks = true;
#else
inline constexpr bool kPicks = false;
#endif
// Lane i of the result is lane `lane[i]` of `values`; of `lane` only the bits that number lanes count.
PADE_INLINE V pick(V values, I lane) {
#if defined(__AVX512F__)
  return V(_mm512_maskz_permutexvar_ps(kAll, __m512i(lane), __m512(values)));
#elif defined(__AVX2__)
  return V(_mm256_permutevar8x32_ps(__m256(values), __m256i(lane)));
#else
  V out;
  for (int i = 0; i < kLanes; ++i) out[i] = values[lane[i] & (kLanes - 1)];
  return out;
#endif
}

PADE_INLINE I truncate(V a) { return __builtin_convertvector(a, I); }
PADE_INLINE V to_float(I a) { return __builtin_convertvector(a, V); }
PADE_INLINE V abs(V a) { return V(I(a) & 0x7fffffff); }
PADE_INLINE V select(I mask, V yes, V no) { return mask ? yes : no; }
// Into [low, high]; NaN becomes low.
PADE_INLINE V clamp(V a, float low, float high) { return min(max(a, set(low)), set(high)); }

PADE_INLINE bool all(I mask) {
#if defined(__AVX512F__)
  return _mm512_test_epi32_mask(__m512i(mask), __m512i(mask)) == kAll;
#elif defined(__AVX2__)
  return _mm256_movemask_epi8(__m256i(mask)) == -1;
#elif defined(__SSE2__)
  return _mm_movemask_epi8(__m128i(mask)) == 0xffff;
#elif defined(__aarch64__)
  return vminvq_u32(uint32x4_t(mask)) != 0;
#else
  return (mask[0] & mask[1] & mask[2] & mask[3]) != 0;
#endif
}

// Bit i is lane i of a mask.
PADE_INLINE unsigned bits(I mask) {
#if defined(__AVX512F__)
  return _mm512_test_epi32_mask(__m512i(mask), __m512i(mask));
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps(__m256(mask)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(__m128(mask)));
#elif defined(__aarch64__)
  constexpr uint32x4_t kLane = {1, 2, 4, 8};
  return vaddvq_u32(vandq_u32(uint32x4_t(mask), kLane));
#else
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2) | (mask[2] & 4) | (mask[3] & 8));
#endif
}

// The least of the lanes.
PADE_INLINE float least(V a) {
#if defined(__AVX512F__)
  a = min(a, __builtin_shufflevector(a, a, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7));
  a = min(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11));
  a = min(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13));
  a = min(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14));
#elif defined(__AVX2__)
  a = min(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
  a = min(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
  a = min(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6));
#else
  a = min(a, V{a[2], a[3], a[0], a[1]});
  a = min(a, V{a[1], a[0], a[3], a[2]});
#endif
  return a[0];
}

}  // namespace pade::simd::PADE_ISA
