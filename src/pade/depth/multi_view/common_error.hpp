// The part of the variance of inverse depth from several views that is the motion's own: common to the whole
// image.
#pragma once

#include <array>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"

namespace pade::depth {

/// First order. With the motion (t, theta) of a view, covariance Sigma, and a = A t (docs/method.md), a
/// pixel's inverse depth rho is read along a, so that
///   delta rho = a^T (rho A delta t + B delta theta) / |a|^2,   variance = J Sigma J^T.
/// Of several views the longest baseline decides over which the point has not moved too far to be used.
class CommonError {
 public:
  /// Exact motions.
  CommonError() = default;
  /// @param views  their motions as seen from the reference, with covariances. @param largest_parallax  px,
  /// over which a view is not used for a point
  CommonError(const Camera& camera, const std::vector<RelativeMotion>& views, double largest_parallax);

  [[nodiscard]] bool is_exact() const { return views_.empty(); }
  /// Variance of the inverse depth `rho` (1/m) of pixel (u, v), 1/m^2.
  [[nodiscard]] float operator()(int u, int v, float rho) const;

 private:
  struct View {
    std::array<float, 3> t;
    std::array<float, 21> covariance;  // upper triangle, row by row; twice what is off the diagonal
  };
  std::vector<View> views_;  // longest first
  float fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;
  float largest_parallax2_ = 0;
};

}  // namespace pade::depth
