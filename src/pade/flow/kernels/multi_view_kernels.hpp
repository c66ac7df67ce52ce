// Inverse depth from several views of a static scene: what is new against one epipolar pair. Formulas in
// multi_view_kernels.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// How another view sees the reference: pixel p at distance d lies at (H p~ + d e) / its third component.
struct ViewGeometry {
  float H[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row; of points at infinity
  float e[3] = {0, 0, 0};                    ///< per unit of distance
  float largest_parallax2 = 0;  ///< px^2, from the point at infinity; farther points are not used
  float largest_scale = 1;      ///< nor those that come nearer or go farther by more than this
};

/// What one view adds to the sums over all views, of the data term about the present distance.
struct ViewTensor {
  PlaneView first, second;
  PlaneView distance;
  PlaneView sum11, sum13;  ///< of the tensors, robustly weighted
  const float* taps = nullptr;
  int radius = 0;
  float gamma = 0;
  float epsilon2 = 1;  ///< of the robust weight
};

/// Truncated residuals at a pixel's own distance and at those that compete with it.
struct ViewCosts {
  static constexpr int kRivals = 3;  ///< the first of them is the pixel's own
  PlaneView first, second;
  PlaneView distance[kRivals];
  PlaneView cost[kRivals], count[kRivals];  ///< sums, and numbers of views that see the pixel
  float same = 0;                           ///< distances that differ by no more than this cost the same
};

/// What the views say at the solution.
struct ViewEvidence {
  PlaneView first, second;
  PlaneView distance;     ///< solution
  PlaneView information;  ///< sum over the views of 1 / sigma^2 of the distance
  PlaneView step, step2;  ///< sums of information * step and * step^2 that each view asks for
  PlaneView offset;       ///< sum of information * (distance of the texture around - a pixel's own)
  PlaneView matching;     ///< number of views that match
  /// Over these views, sums of the mean squared slopes along the line, per px: of the image, and of what is
  /// left of it after the match.
  PlaneView texture, left;
  const float* taps = nullptr;
  int radius = 0;
  float noise = 1;  ///< of the residual's variance, grey values, at least
  float effective_size = 1;
};

/// Adds one view's tensor, robustly; `reset` starts the sums. `scratch`: tensor_scratch() floats.
PADE_DECLARE_KERNEL(void view_tensor(const ViewGeometry& view, const ViewTensor& tensor, bool reset,
                                     int first, int last, float* scratch))
PADE_DECLARE_KERNEL(long tensor_scratch(int radius, int width))
/// Adds a view's truncated residuals, and whether it has them.
PADE_DECLARE_KERNEL(void view_costs(const ViewGeometry& view, const ViewCosts& costs, bool reset, int first,
                                    int last))
/// Adds one view's evidence; `reset` starts the sums. `scratch`: evidence_scratch() floats.
PADE_DECLARE_KERNEL(void view_evidence(const ViewGeometry& view, const ViewEvidence& evidence, bool reset,
                                       int first, int last, float* scratch))
PADE_DECLARE_KERNEL(long evidence_scratch(int radius, int width))

}  // namespace pade::flow
