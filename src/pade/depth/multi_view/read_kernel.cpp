#include "pade/depth/multi_view/read_kernel.hpp"

#include "pade/core/compute/vec.hpp"

#ifndef PADE_ISA
#define PADE_ISA baseline
#endif

namespace pade::depth::PADE_ISA {
namespace {

using namespace simd::PADE_ISA;

constexpr float kTexture = 1.6F;       // least squared slopes, in those of noise
constexpr float kClearTexture = 2.4F;  // ... of a pixel that has a bound, but no depth
constexpr float kVague = 0.5F;         // px: sigma of the parallax from which on the image says nothing of it

// Values of DepthState, as in depth_kernel.cpp.
constexpr int kMeasured = 0;
constexpr int kEpipole = 1;
constexpr int kLowParallax = 2;
constexpr int kNoTexture = 3;
constexpr int kInconsistent = 4;
constexpr int kOutOfView = 5;
constexpr int kFar = 6;

using Bytes [[gnu::vector_size(kLanes)]] = unsigned char;

/// The first `count` numbers of a row's end; what would lie behind it is zero.
struct Some {
  int count;
  [[gnu::always_inline]] V get(const float* from) const {
    if (count == kLanes) return load(from);
    float some[kLanes] = {};
    __builtin_memcpy(some, from, static_cast<unsigned long>(count) * sizeof(float));
    return load(some);
  }
  [[gnu::always_inline]] void put(float* to, V value) const {
    if (count == kLanes) return store(to, value);
    float some[kLanes];
    store(some, value);
    __builtin_memcpy(to, some, static_cast<unsigned long>(count) * sizeof(float));
  }
  [[gnu::always_inline]] I get(const unsigned char* from) const {
    Bytes bytes{};
    if (count == kLanes) {
      __builtin_memcpy(&bytes, from, sizeof bytes);
    } else {
      __builtin_memcpy(&bytes, from, static_cast<unsigned long>(count));
    }
    return __builtin_convertvector(bytes, I);
  }
  [[gnu::always_inline]] void put(unsigned char* to, I value) const {
    const Bytes bytes = __builtin_convertvector(value, Bytes);
    if (count == kLanes) {
      __builtin_memcpy(to, &bytes, sizeof bytes);
    } else {
      __builtin_memcpy(to, &bytes, static_cast<unsigned long>(count));
    }
  }
};

PADE_INLINE I choose(I mask, I yes, I no) { return (mask & yes) | (~mask & no); }

/// Variance of the inverse depth `rho` that the motions make: CommonError::operator().
PADE_INLINE V common_error(const ReadParameters& p, const float* common, int width, const Some& some, V rho) {
  if (p.views == 0) return V{};
  V of[3] = {};
  for (int view = p.views - 1; view >= 0; --view) {
    const float* const lines = common + 4L * view * width;
    const I used = view == p.views - 1 ? set(-1) : ~I(some.get(lines) * rho * rho > p.largest_parallax2);
    for (int i = 0; i < 3; ++i) of[i] = select(used, some.get(lines + (i + 1L) * width), of[i]);
  }
  return rho * (rho * of[0] + of[1]) + of[2];
}

PADE_INLINE void read(const ReadParameters& p, const ReadField& f, int width, int u, const ReadRow& row,
                      const Some& some) {
  const V nan = set(__builtin_nanf(""));
  const V d = some.get(f.distance + u);
  const V information = some.get(f.information + u);
  const V matching = some.get(f.matching + u);
  const V texture = some.get(f.texture + u);
  const V offset = some.get(f.offset + u);
  const I before = some.get(row.state + u);

  const I seen = ~I((before == kInconsistent) | (before == kOutOfView) | (before == kNoTexture));
  const I clear = seen & I(information > 0.0F) & I(texture > kTexture);
  const V contradiction =
      select(I(matching > 1.0F), max(some.get(f.spread + u) / (matching - 1.0F), set(1.0F)), set(1.0F));
  const V sigma2 = p.sigma_scale2 * contradiction / information + p.relative2 * d * d + offset * offset;
  const I measured = clear & I(d > 0.0F) & I(sigma2 * p.gate2 < d * d) & I(p.scale <= p.range * d);
  // A vague bound is worse than that of the outline around.
  const I told = measured | (clear & I(texture > kClearTexture));
  const I untold = (clear & ~told) | (seen & ~clear & I(matching > 0.0F));

  const V positive = select(I(d < 0.0F), V{}, d);
  const V shared = p.scale2 * common_error(p, f.common + u, width, some, positive * p.per_scale);
  const V bound = p.scale / (positive + p.bound_sigmas * sqrt(sigma2 + shared));
  some.put(row.of_views + u, select(told, bound, set(__builtin_inff())));
  // Where no pixel around has plain texture, that of the pair was noise too.
  const I blank = seen & I(matching > 0.0F) & I(texture == 0.0F);
  V known = select(blank, nan, some.get(row.bound + u));
  known = select(told & ~I(known >= bound), bound, known);
  some.put(row.bound + u, known);

  // What is seen without being measured.
  const I asked = told & ~measured & (before != kEpipole);
  const I vague = I(sigma2 > kVague * kVague);
  const I refused = asked & ((before == kMeasured) | vague);
  I state = choose(refused, choose(vague, set(kNoTexture), set(kLowParallax)), before);
  state = choose(asked & (state == kLowParallax) & I(known >= p.range), set(kFar), state);
  state = choose(untold, set(kNoTexture), state);
  state = choose(measured, set(kMeasured), state);
  some.put(row.state + u, state);

  const I dropped = refused | untold;
  const V z = p.scale / d;
  const V e2 = sigma2 / (d * d);
  const V own = z * z * e2 * (1.0F + e2 * (18.0F + 400.0F * e2));
  const V all_of_it = own + z * z * shared / (d * d);
  const auto place = [&](float* at, V value) {
    some.put(at + u, select(measured, value, select(dropped, nan, some.get(at + u))));
  };
  place(row.depth, z);
  place(row.own_variance, own);
  place(row.variance, all_of_it);
}

}  // namespace

void read_row(const ReadParameters& p, const ReadField& field, int width, const ReadRow& row) {
  int u = 0;
  for (; u + kLanes <= width; u += kLanes) read(p, field, width, u, row, Some{kLanes});
  if (u < width) read(p, field, width, u, row, Some{width - u});
}

}  // namespace pade::depth::PADE_ISA
