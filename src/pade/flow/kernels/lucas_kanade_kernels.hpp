// One iteration of dense Lucas-Kanade on one pyramid level; the formulas are in lucas_kanade_kernels.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// A pyramid level and the flow on it. All planes have one size and stride.
struct LucasKanadeLevel {
  PlaneView first;
  PlaneView second;
  PlaneView mask;        ///< 0 = no data at this pixel of `first`; data null = all are used
  PlaneView gradient_x;  ///< of `first`
  PlaneView gradient_y;
  PlaneView inverse_xx;  ///< inverse of the windowed structure tensor plus damping
  PlaneView inverse_xy;
  PlaneView inverse_yy;
  PlaneView u;  ///< flow before the iteration, pixels
  PlaneView v;
  PlaneView next_u;  ///< and after it
  PlaneView next_v;
  const float* taps = nullptr;  ///< half of the symmetric window
  int radius = 0;
  float damping = 0;
  float largest_step = 0;  ///< an iteration moves the flow by no more, pixels
};

PADE_DECLARE_KERNEL(void lucas_kanade_prepare(const LucasKanadeLevel& level, int first, int last,
                                              float* scratch))
PADE_DECLARE_KERNEL(void lucas_kanade_iterate(const LucasKanadeLevel& level, int first, int last,
                                              float* scratch))
/// Floats of scratch that both need.
PADE_DECLARE_KERNEL(long lucas_kanade_scratch(int radius, int width))

}  // namespace pade::flow
