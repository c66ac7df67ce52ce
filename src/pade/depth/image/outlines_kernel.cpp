#include "pade/depth/image/outlines_kernel.hpp"

#include "pade/core/compute/vec.hpp"

#ifndef PADE_ISA
#define PADE_ISA baseline
#endif

namespace pade::depth::PADE_ISA {
namespace {

using namespace simd::PADE_ISA;

constexpr float kFewestRays = 5;  // of eight
constexpr float kUnknown = __builtin_inff();

static_assert(kOutlineSlack >= kLanes);

/// What the two ends of a line meet.
struct Ends {
  V a, a_steps, b, b_steps;
};

/// Inverse of the bound that a line gives to a pixel between its ends.
[[gnu::always_inline]] inline V between(const Ends& e) {
  const I known = I(e.a >= 0.0F) & I(e.a < kUnknown) & I(e.b >= 0.0F) & I(e.b < kUnknown);
  return select(known, (e.a * e.b_steps + e.b * e.a_steps) / (e.a_steps + e.b_steps), set(kUnknown));
}

}  // namespace

void outline_row(const float* own, int width, int step, const OutlineRow& before, const OutlineRow& here) {
  // Along the row each pixel needs the one before it.
  float met = -1;
  int at = step > 0 ? -1 : width;
  for (int j = 0; j < width; ++j) {
    const int u = step > 0 ? j : width - 1 - j;
    const bool open = own[u] < 0;
    met = open ? met : own[u];
    at = open ? at : u;
    here.rho[0][u] = met;
    here.steps[0][u] = static_cast<float>(step > 0 ? u - at : at - u);
  }
  const int from[kOutlineRays] = {0, 0, -step, step};
  for (int i = 1; i < kOutlineRays; ++i) {
    const float* const rho = before.rho[i] + from[i];
    const float* const steps = before.steps[i] + from[i];
    for (int u = 0; u < width; u += kLanes) {
      const V mine = load(own + u);
      const I open = I(mine < 0.0F);
      store(here.rho[i] + u, select(open, load(rho + u), mine));
      store(here.steps[i] + u, select(open, load(steps + u) + 1.0F, V{}));
    }
    here.rho[i][width] = -1;
    here.steps[i][width] = 0;
  }
}

void outline_bounds(const OutlineRow& a, const OutlineRow& b, int count, float* out) {
  for (int u = 0; u < count; u += kLanes) {
    V line[kOutlineRays];
    V greatest{};
    V rays{};
    for (int i = 0; i < kOutlineRays; ++i) {
      const Ends ends{load(a.rho[i] + u), load(a.steps[i] + u), load(b.rho[i] + u), load(b.steps[i] + u)};
      line[i] = between(ends);
      greatest = max(greatest, max(ends.a, ends.b));
      rays = rays + (select(I(ends.a >= 0.0F), set(1.0F), V{}) + select(I(ends.b >= 0.0F), set(1.0F), V{}));
    }
    const V low = max(min(line[0], line[1]), min(line[2], line[3]));
    const V high = min(max(line[0], line[1]), max(line[2], line[3]));
    const V second = min(low, high);
    const V fallback = select(I(rays >= kFewestRays), greatest, set(kUnknown));
    store(out + u, select(I(second < kUnknown), second, fallback));
  }
}

}  // namespace pade::depth::PADE_ISA
