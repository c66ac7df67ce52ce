#include "pade/depth/multi_view/common_error.hpp"

#include <algorithm>
#include <array>

#include "pade/depth/derotation.hpp"

namespace pade::depth {
namespace {

/// A and B of a pixel, by columns.
struct PixelMatrices {
  PixelMatrices(const Camera& camera, const Eigen::Vector2d& p) {
    for (int i = 0; i < 3; ++i) {
      A[static_cast<std::size_t>(i)] = times_A(camera, p, Eigen::Vector3d::Unit(i));
      B[static_cast<std::size_t>(i)] = times_B(camera, p, Eigen::Vector3d::Unit(i));
    }
  }
  std::array<Eigen::Vector2d, 3> A, B;
};

Eigen::Vector3d times_columns(const Eigen::Vector2d& a, const std::array<Eigen::Vector2d, 3>& columns) {
  return {a.dot(columns[0]), a.dot(columns[1]), a.dot(columns[2])};
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
  columns_ = (camera.width + cell - 1) / cell;
  const int rows = (camera.height + cell - 1) / cell;
  cells_.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns_) * views_);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns_; ++c) {
      const Eigen::Vector2d p(c * cell + 0.5 * (cell - 1) - camera.cx,
                              r * cell + 0.5 * (cell - 1) - camera.cy);
      const PixelMatrices matrices(camera, p);
      for (const RelativeMotion& motion : sorted) {
        const Eigen::Vector2d a = times_A(camera, p, motion.t_reference_other);
        const Eigen::Vector3d t = times_columns(a, matrices.A);
        const Eigen::Vector3d theta = times_columns(a, matrices.B);
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

void CommonError::expand(int row, int width, std::vector<float>& out) const {
  const auto n = static_cast<std::size_t>(width);
  out.resize(4 * views_ * n);
  const Cell* const cells =
      cells_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) * views_;
  for (std::size_t view = 0; view < views_; ++view) {
    float* const lines = out.data() + 4 * view * n;
    for (std::size_t u = 0; u < n; ++u) {
      const Cell& at = cells[u / cell * views_ + view];
      lines[u] = at.parallax2;
      lines[n + u] = at.of_translation;
      lines[2 * n + u] = at.of_both;
      lines[3 * n + u] = at.of_rotation;
    }
  }
}

}  // namespace pade::depth
