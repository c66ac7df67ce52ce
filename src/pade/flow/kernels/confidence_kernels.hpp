// How sure a flow is, pixel by pixel; the formulas are in confidence_kernels.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

struct ConfidenceInput {
  PlaneView first, second;
  PlaneView u, v;                    ///< flow from `first` to `second`
  PlaneView backward_u, backward_v;  ///< flow from `second` to `first`; data null = none
  PlaneView sigma;                   ///< result, pixels
  const float* taps = nullptr;       ///< window, normalised to sum 1
  int radius = 0;
  float noise = 0;           ///< standard deviation of grey values, at least
  float effective_size = 0;  ///< 1 / sum of squared window weights, pixels
};

PADE_DECLARE_KERNEL(void flow_sigma(const ConfidenceInput& input, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(long confidence_scratch(int radius, int width))

}  // namespace pade::flow
