// Flow with one unknown per pixel: the distance along a known epipolar line. Formulas in
// epipolar_kernels.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/clg_kernels.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// The lines and the flow on them, at one pyramid level: w = base + distance * direction, all in pixels.
struct EpipolarLevel {
  PlaneView base_u, base_v;            ///< flow of a point at infinity
  PlaneView direction_x, direction_y;  ///< unit vector, or zero if the line is not defined
};

struct EpipolarLucasKanade {
  EpipolarLevel line;
  PlaneView first, second;
  PlaneView slope;    ///< derivative of `first` along the line
  PlaneView inverse;  ///< 1 / (windowed sum of squared slopes + damping)
  PlaneView distance;
  PlaneView next_distance;
  const float* taps = nullptr;
  int radius = 0;
  float damping = 0;
  float largest_step = 0;
};

struct EpipolarClg {
  EpipolarLevel line;
  PlaneView first, second;
  PlaneView mean, difference;  ///< of the first and the warped second image
  PlaneView distance0;         ///< at which the second image was warped
  PlaneView distance;          ///< present distance
  PlaneView j11, j13, j33;     ///< smoothed motion tensor along the line
  SplitView split_distance, inverse, right_hand_side, right, below;
  const float* taps = nullptr;
  int radius = 0;
  float alpha = 0;
  float gamma = 0;
  float data_epsilon2 = 0;
  float smooth_epsilon2 = 0;
};

/// u = base_u + distance * direction_x, v likewise.
PADE_DECLARE_KERNEL(void epipolar_flow(const EpipolarLevel& line, PlaneView distance, PlaneView u,
                                       PlaneView v, int first, int last))
/// The slope, and the windowed inverse. `scratch` as for lucas_kanade_prepare.
PADE_DECLARE_KERNEL(void epipolar_lk_slope(const EpipolarLucasKanade& level, int first, int last,
                                           float* scratch))
PADE_DECLARE_KERNEL(void epipolar_lk_prepare(const EpipolarLucasKanade& level, int first, int last,
                                             float* scratch))
PADE_DECLARE_KERNEL(void epipolar_lk_iterate(const EpipolarLucasKanade& level, int first, int last,
                                             float* scratch))
/// Takes `width` vectors of two components apart; those that are not finite become zero.
PADE_DECLARE_KERNEL(void split_components(const float* from, float* x, float* y, int width))
/// Every other pixel of every other row, times `factor`.
PADE_DECLARE_KERNEL(void every_other(PlaneView from, PlaneView to, float factor, int first, int last))
/// Warps the second image to the present distance, which becomes distance0, and splits it.
PADE_DECLARE_KERNEL(void epipolar_clg_warp(const EpipolarClg& level, int first, int last))
PADE_DECLARE_KERNEL(void epipolar_clg_tensor(const EpipolarClg& level, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(void epipolar_clg_system(const EpipolarClg& level, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(void epipolar_clg_relax(const EpipolarClg& level, int sweeps, float omega))

}  // namespace pade::flow
