#include "pade/evaluation/cramer_rao.hpp"

#include <cmath>
#include <limits>

namespace pade::evaluation {
namespace {

using Row3 = Eigen::RowVector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

// A and B of Eq. 1 at p, relative to the principal point.
Matrix23 matrix_A(const Camera& camera, const Eigen::Vector2d& p) {
  return (Matrix23() << camera.fx, 0, -p.x(), 0, camera.fy, -p.y()).finished();
}

Matrix23 matrix_B(const Camera& camera, const Eigen::Vector2d& p) {
  const double u = p.x() / camera.fx, v = p.y() / camera.fy;
  return (Matrix23() << -camera.fx * u * v, camera.fx * (1 + u * u), -camera.fx * v, -camera.fy * (1 + v * v),
          camera.fy * u * v, camera.fy * u)
      .finished();
}

double variance_of(const Row3& gradient, const Eigen::Vector3d& sigma) {
  return gradient.transpose().cwiseProduct(sigma).squaredNorm();
}

// The bound at pixel p; NaN for none.
double bound_at(const Camera& camera, const Eigen::Vector3d& t, const Eigen::Vector2d& p, double Z,
                double sigma_px, const PoseNoise& noise) {
  const Matrix23 A = matrix_A(camera, p);
  const Eigen::Vector2d a = -A * t;
  const double a2 = a.squaredNorm();
  const double s = Z - t.z();
  if (!(Z > 0) || std::isinf(Z) || !(s > 0) || !(a2 > 0)) return std::numeric_limits<double>::quiet_NaN();
  double variance = std::pow(s, 4) * sigma_px * sigma_px / a2;
  if (!noise.is_zero()) {
    const Row3 along_t = -s / a2 * a.transpose() * A + Row3::UnitZ();
    const Row3 along_theta = -s * s / a2 * a.transpose() * matrix_B(camera, p + a / s);
    variance += variance_of(along_t, noise.translation) + variance_of(along_theta, noise.rotation);
  }
  return std::sqrt(variance);
}

}  // namespace

PoseNoise uniform_noise(const RelativeMotion& motion, double level) {
  const double sigma = level / std::sqrt(3.0);
  return {sigma * motion.t_reference_other.cwiseAbs(), sigma * motion.rotation_vector().cwiseAbs()};
}

cv::Mat depth_bound(const Camera& camera, const RelativeMotion& motion, const cv::Mat& true_depth,
                    double sigma_px, const PoseNoise& noise) {
  cv::Mat bound(true_depth.size(), CV_32FC1);
  for (int v = 0; v < bound.rows; ++v) {
    const auto* Z = true_depth.ptr<float>(v);
    auto* out = bound.ptr<float>(v);
    for (int u = 0; u < bound.cols; ++u) {
      const Eigen::Vector2d p(u - camera.cx, v - camera.cy);
      out[u] = static_cast<float>(bound_at(camera, motion.t_reference_other, p, Z[u], sigma_px, noise));
    }
  }
  return bound;
}

}  // namespace pade::evaluation
