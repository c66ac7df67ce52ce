// Polynomial expansion and one displacement iteration of Farneback's method; formulas in the source file.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// I(x, y) ~ c + bx x + by y + axx x^2 + ayy y^2 + axy x y around each pixel.
struct ExpansionView {
  PlaneView bx, by, axx, ayy, axy;
};

/// The separable filters of the expansion: Gaussian applicability g and its moments, and the inverse of the
/// normal matrix, which has only these entries for a symmetric window.
struct ExpansionFilters {
  const float* g = nullptr;    ///< g(0) to g(radius), sum over both sides 1
  const float* xg = nullptr;   ///< x g(x)
  const float* xxg = nullptr;  ///< x^2 g(x)
  int radius = 0;
  float linear = 0;    ///< weight of the first moments
  float constant = 0;  ///< weight of the mean in axx and ayy
  float square = 0;    ///< weight of the second moments in axx and ayy
  float product = 0;   ///< weight of the mixed moment
};

/// A pyramid level and the flow on it. All planes have one size and stride.
struct FarnebackLevel {
  ExpansionView first;
  ExpansionView second;
  PlaneView mask;  ///< 0 = no data at this pixel of the first image; data null = all are used
  PlaneView u;     ///< flow before the iteration, pixels
  PlaneView v;
  PlaneView next_u;  ///< and after it
  PlaneView next_v;
  const float* taps = nullptr;  ///< half of the symmetric window
  int radius = 0;
  float damping = 0;
  float largest_step = 0;  ///< an iteration moves the flow by no more, pixels
};

/// Rows [first, last). `scratch`: 3 (padded(width) + 2 kRowMultiple) floats.
PADE_DECLARE_KERNEL(void farneback_expand(PlaneView image, const ExpansionView& expansion,
                                          const ExpansionFilters& filters, int first, int last,
                                          float* scratch))
PADE_DECLARE_KERNEL(void farneback_iterate(const FarnebackLevel& level, int first, int last, float* scratch))
/// Floats of scratch that farneback_iterate needs.
PADE_DECLARE_KERNEL(long farneback_scratch(int radius, int width))

}  // namespace pade::flow
