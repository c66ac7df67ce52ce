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

/// One view's tensors, and the sums over all views.
struct ViewTensor {
  PlaneView j11, j13, j33;  ///< of this view
  PlaneView sum11, sum13;   ///< robustly weighted sums
  float epsilon2 = 1;       ///< of the robust weight
};

/// What the views say at the solution.
struct ViewEvidence {
  EpipolarLevel line;  ///< of this view
  PlaneView first, second;
  PlaneView distance;         ///< solution
  PlaneView information;      ///< sum over the views of 1 / sigma^2 of the distance
  PlaneView step, step2;      ///< sums of information * step and * step^2 that each view asks for
  PlaneView matching, wrong;  ///< numbers of views that match, and that do not
  const float* taps = nullptr;
  int radius = 0;
  float noise = 1;        ///< of the residual's variance, grey values, at least
  float image_noise = 0;  ///< of the image, as far as it is known
  float effective_size = 1;
};

/// Linearises the lines of a view about `distance`: p + base + d * direction. Zero where the view is not
/// used.
PADE_DECLARE_KERNEL(void view_lines(const ViewGeometry& view, PlaneView distance, const EpipolarLevel& line,
                                    int first, int last))
/// Adds a view's truncated residual at `distance`, and whether it has one.
PADE_DECLARE_KERNEL(void view_cost(const ViewGeometry& view, PlaneView reference, PlaneView seen,
                                   PlaneView distance, PlaneView cost, PlaneView count, bool reset, int first,
                                   int last))
/// Adds one view's tensor, robustly; `reset` starts the sums.
PADE_DECLARE_KERNEL(void view_add(const ViewTensor& tensor, bool reset, int first, int last))
/// Adds one view's evidence; `reset` starts the sums. `scratch`: evidence_scratch() floats.
PADE_DECLARE_KERNEL(void view_evidence(const ViewEvidence& evidence, bool reset, int first, int last,
                                       float* scratch))
PADE_DECLARE_KERNEL(long evidence_scratch(int radius, int width))

}  // namespace pade::flow
