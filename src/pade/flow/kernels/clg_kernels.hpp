// The steps of combined local-global flow on one pyramid level; the formulas are in clg_kernels.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// A plane whose rows hold the even columns first and then the odd ones, so that one colour of a checkerboard
/// is contiguous: element 2 k at even(y)[k], element 2 k + 1 at odd(y)[k]. Guards of zeros on all sides.
struct SplitView {
  float* data = nullptr;
  int half = 0;    ///< padded length of each part
  int height = 0;  ///< rows -1 and `height` exist too

  [[nodiscard]] static constexpr int stride_of(int half_length) { return 2 * half_length + 3 * kRowMultiple; }
  [[nodiscard]] int stride() const { return stride_of(half); }
  [[nodiscard]] float* even(int y) const { return data + static_cast<long>(y + 1) * stride() + kRowMultiple; }
  [[nodiscard]] float* odd(int y) const { return even(y) + half + kRowMultiple; }
  [[nodiscard]] float* part(int y, int parity) const { return parity == 0 ? even(y) : odd(y); }
};

/// The sparse linear system for (u, v) of one lagged step: with the sum over the four neighbours j
///   (u, v) = M (b + sum_j w_j (u_j, v_j)).
struct ClgSystem {
  SplitView u, v;
  SplitView m11, m12, m22;
  SplitView b1, b2;
  SplitView right;  ///< smoothness weight between a pixel and its right neighbour
  SplitView below;  ///< and the one below
};

struct ClgLevel {
  PlaneView first, second;
  PlaneView mask;                          ///< 0 = no data at this pixel of `first`; data null = all are used
  PlaneView mean, difference;              ///< of the first and the warped second image
  PlaneView u0, v0;                        ///< flow at which the second image was warped
  PlaneView u, v;                          ///< present flow
  PlaneView j11, j12, j22, j13, j23, j33;  ///< smoothed motion tensor
  ClgSystem system;
  const float* taps = nullptr;  ///< window of the tensor
  int radius = 0;
  float alpha = 0;            ///< smoothness weight
  float gamma = 0;            ///< weight of gradient constancy
  float data_epsilon2 = 0;    ///< of the robust data term; 0 = quadratic
  float smooth_epsilon2 = 0;  ///< of the robust smoothness term; 0 = quadratic
  float normalisation = 0;    ///< zeta^2 of the constraint normalisation; 0 = none
};

/// The rows that half-sweep j = 0, 1, ... visits: from first + j first_step to last + j last_step, within the
/// image. All rows: {0, 0, height, 0}. Pieces whose borders retreat (steps 1 and -1) may run at once; what
/// they leave around a border is {border, -1, border, 1}, to be run after both. Together they are the same
/// sweeps, to the bit.
struct SweepRows {
  int first, first_step;
  int last, last_step;
};

PADE_DECLARE_KERNEL(void clg_warp(const ClgLevel& level, int first, int last))
PADE_DECLARE_KERNEL(void clg_tensor(const ClgLevel& level, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(void clg_system(const ClgLevel& level, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(void clg_relax(const ClgSystem& system, int sweeps, float omega, const SweepRows& rows))
PADE_DECLARE_KERNEL(void clg_split(PlaneView from, SplitView to, int first, int last))
PADE_DECLARE_KERNEL(void clg_join(SplitView from, PlaneView to, int first, int last))
PADE_DECLARE_KERNEL(long clg_scratch(int radius, int width))

}  // namespace pade::flow
