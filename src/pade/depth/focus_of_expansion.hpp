// The focus of expansion from a derotated flow field, as Time To Collision needs it.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace pade::depth {

/// One derotated flow vector.
struct FlowSample {
  Eigen::Vector2d position;  ///< relative to the principal point, px
  Eigen::Vector2d flow;      ///< derotated, px
};

/// Where the extensions of all flow vectors meet.
struct FocusOfExpansion {
  Eigen::Vector2d position;    ///< relative to the principal point, px; may lie outside the image
  Eigen::Matrix2d covariance;  ///< px^2, from the scatter of the flow across the lines through `position`
  double flow_sigma;           ///< that scatter: robust standard deviation, px
};

/// Minimises sum_i w_i (n_i . (p_i - e))^2 over e, n_i the unit normal of flow vector i, with the
/// noise-optimal weights w_i = |d_i|^2 / |p_i - e|^2 and Tukey's robust weight, iterated. Empty where the
/// vectors do not meet within `farthest` px of the principal point: the motion has no forward component worth
/// the name.
std::optional<FocusOfExpansion> focus_of_expansion(const std::vector<FlowSample>& samples, double farthest);

}  // namespace pade::depth
