// The part of the variance of inverse depth from several views that is the motion's own: common to the whole
// image.
#pragma once

#include <cstddef>
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
  /// @param camera  undistorted pinhole of all frames.
  /// @param views  their motions as seen from the reference, with covariances. @param largest_parallax  px,
  /// over which a view is not used for a point
  CommonError(const Camera& camera, const std::vector<RelativeMotion>& views, double largest_parallax);

  /// True if no motion has an error: the variance is zero everywhere.
  [[nodiscard]] bool is_exact() const { return cells_.empty(); }
  /// Variance of the inverse depth `rho` (1/m) of pixel (u, v), 1/m^2; as it is in the middle of the pixel's
  /// cell, 4 x 4.
  [[nodiscard]] float operator()(int u, int v, float rho) const {
    if (cells_.empty()) return 0;
    const Cell* at = &cells_[static_cast<std::size_t>(v / cell * columns_ + u / cell) * views_];
    const Cell* const shortest = at + views_ - 1;
    while (at != shortest && at->parallax2 * rho * rho > largest_parallax2_) ++at;
    return rho * (rho * at->of_translation + at->of_both) + at->of_rotation;
  }
  static constexpr int cell = 4;  ///< px
  /// Views that are asked; 0 = all are exact.
  [[nodiscard]] int views() const { return static_cast<int>(views_); }
  /// px^2: over which a view is not used for a point.
  [[nodiscard]] float largest_parallax2() const { return largest_parallax2_; }
  /// What a row of cells holds, for each of its pixels: for each view, the longest baseline first, |a|^2 and
  /// the three coefficients of the variance, each `width` numbers.
  /// @param row    of the cells
  /// @param width  of the image, px
  /// @param out    those numbers, resized as they need it
  void expand(int row, int width, std::vector<float>& out) const;

 private:
  /// Of one view: the variance is a quadratic in rho.
  struct Cell {
    float parallax2;  // |a|^2
    float of_translation, of_both, of_rotation;
  };
  std::vector<Cell> cells_;  // row by row, the views of each together, longest first
  std::size_t views_ = 0;
  int columns_ = 0;
  float largest_parallax2_ = 0;
};

}  // namespace pade::depth
