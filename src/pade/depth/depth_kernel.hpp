// The arithmetic of PADE on rows of pixels, compiled once per instruction set. Plain arrays in, plain arrays
// out: the meaning of each quantity is in depth_estimator.hpp and docs/method.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::depth {

/// How rotation leaves the flow.
enum class KernelDerotation : int {
  none,         ///< the flow is already derotated (the image was); only the view test needs the rotation
  exact,        ///< D = f b'_xy / b'_z - x with b' = R (x + w)/f
  first_order,  ///< d = w + B omega
  remaining,    ///< exact, of what the rotation that was removed from the image has left; tests the view as
                ///< none
};

/// Constants of one image pair. Pixels are relative to the principal point of the reference.
struct KernelParameters {
  float fx, fy, inverse_fx, inverse_fy;
  float fx_tx, fy_ty, tz;  ///< translation t_reference_other, first two times the focal length
  float turn[9];           ///< row-major R - I of the rotation that is left in the flow (exact, remaining)
  float view[9];           ///< row-major R - I back into the other image (none, remaining)
  float omega[3];          ///< rotation vector of R_reference_other (first_order)
  float add_tz;            ///< t_z for the exact model, else 0
  float sigma2;            ///< variance of each flow component, px^2, where there is no plane of sigmas
  float sigma_scale2;      ///< what the variances of the flow are multiplied by
  float relative2;  ///< variance of the flow per |D|^2: what a method errs by where neighbours move unlike
  float parallax2;  ///< parallax_gate^2
  float residual2;  ///< residual_gate^2
  float tangent2;   ///< tan(residual_angle)^2
  float blind2;     ///< |a|^2 below this: nothing, however near, has parallax
  float epipole2;   ///< |a|^2 below this: no parallax because of the epipole, not because of distance
  float range;      ///< m
  float axis_variance;  ///< variance added to |a| (uncertain focus of expansion), same unit as |a|^2
  float left, right, top,
      bottom;      ///< where a match counts as inside the other image, relative to the principal point
  float bound_k;   ///< sigmas that the lower bound keeps from what was measured
  float pose[21];  ///< upper triangle, row by row, of the covariance of (t, theta)
  KernelDerotation derotation;
  bool samelson;
  bool has_pose;
};

/// What one row of cells becomes; the planes of DepthImage.
struct DepthRow {
  float* depth;
  float* variance;
  float* own_variance;
  float* bound;
  std::uint8_t* state;
};

/// One row of cells.
/// @param x      columns of the cells, relative to the principal point
/// @param y      row, relative to the principal point
/// @param flow   interleaved (u, v), px; NaN = none
/// @param sigma  standard deviation of each flow component, px, or null for `sigma2`
/// @param gate   0, or the state that is forced on the cell: no_texture, out_of_view
PADE_DECLARE_KERNEL(void depth_row(const KernelParameters& k, const float* x, float y, const float* flow,
                                   const float* sigma, const std::uint8_t* gate, std::size_t count,
                                   const DepthRow& out))

/// Adds one row of flow to the sums of a window: only pixels that have flow and whose gate is 0.
PADE_DECLARE_KERNEL(void accumulate_flow_row(const float* flow, const std::uint8_t* gate, std::size_t count,
                                             float* sum_u, float* sum_v, float* valid))

/// Sums each n neighbours of a row: out[c] = in[c n] + ... + in[c n + n - 1], the last one of what is left.
PADE_DECLARE_KERNEL(void sum_columns(const float* in, std::size_t width, int n, float* out))

/// Mean flow of each window from its sums: interleaved (u, v), and 0 in `empty` where there is one; NaN and 1
/// where no pixel was valid.
PADE_DECLARE_KERNEL(void mean_flow(const float* sum_u, const float* sum_v, const float* valid,
                                   std::size_t count, float* mean, std::uint8_t* empty))

/// Adds the products of one row of image gradients to the columns of a structure tensor.
PADE_DECLARE_KERNEL(void accumulate_gradients(const std::int16_t* gx, const std::int16_t* gy,
                                              std::size_t count, std::int32_t* xx, std::int32_t* xy,
                                              std::int32_t* yy))

}  // namespace pade::depth
