#include "pade/depth/multi_view/common_error.hpp"

#include <algorithm>

#include "pade/depth/derotation.hpp"

namespace pade::depth {
namespace {

/// a^T A and a^T B of a pixel.
struct Lever {
  Eigen::Vector3d translation, rotation;
};

Lever lever(const Camera& camera, const Eigen::Vector2d& p, const Eigen::Vector2d& a) {
  Lever lever;
  for (int i = 0; i < 3; ++i) {
    lever.translation[i] = a.dot(times_A(camera, p, Eigen::Vector3d::Unit(i)));
    lever.rotation[i] = a.dot(times_B(camera, p, Eigen::Vector3d::Unit(i)));
  }
  return lever;
}

}  // namespace

CommonError::CommonError(const Camera& camera, const std::vector<RelativeMotion>& views,
                         double largest_parallax)
    : largest_parallax2_(static_cast<float>(largest_parallax * largest_parallax)) {
  const auto known = [](const RelativeMotion& motion) { return !motion.covariance.isZero(0); };
  if (std::none_of(views.begin(), views.end(), known)) return;
  std::vector<RelativeMotion> sorted = views;
  std::sort(sorted.begin(), sorted.end(), [](const RelativeMotion& a, const RelativeMotion& b) {
    return a.t_reference_other.squaredNorm() > b.t_reference_other.squaredNorm();
  });
  views_ = sorted.size();
  columns_ = (camera.width + kCell - 1) / kCell;
  const int rows = (camera.height + kCell - 1) / kCell;
  cells_.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns_) * views_);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns_; ++c) {
      const Eigen::Vector2d p(c * kCell + 0.5 * (kCell - 1) - camera.cx,
                              r * kCell + 0.5 * (kCell - 1) - camera.cy);
      for (const RelativeMotion& motion : sorted) {
        const Eigen::Vector2d a = times_A(camera, p, motion.t_reference_other);
        const auto [t, theta] = lever(camera, p, a);
        const double aa = std::max(a.squaredNorm(), 1e-9);
        const auto scaled = [&](double value) { return static_cast<float>(value / (aa * aa)); };
        const Matrix6d& sigma = motion.covariance;
        cells_.push_back({static_cast<float>(aa), scaled(t.dot(sigma.topLeftCorner<3, 3>() * t)),
                          scaled(2 * t.dot(sigma.topRightCorner<3, 3>() * theta)),
                          scaled(theta.dot(sigma.bottomRightCorner<3, 3>() * theta))});
      }
    }
  }
}

}  // namespace pade::depth
