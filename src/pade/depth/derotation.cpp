#include "pade/depth/derotation.hpp"

#include <limits>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

namespace pade::depth {

cv::Mat derotate_image(const cv::Mat& image, const Camera& camera, const RelativeMotion& motion) {
  const Eigen::Matrix3d K = camera.matrix();
  const Eigen::Matrix3d homography = K * motion.R_reference_other.transpose() * K.inverse();
  cv::Matx33d map;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) map(r, c) = homography(r, c);
  }
  cv::Mat out;
  cv::warpPerspective(image, out, map, image.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                      cv::BORDER_REPLICATE);
  return out;
}

Derotator::Derotator(const Camera& camera, const RelativeMotion& motion, Model model, Derotation derotation)
    : camera_(camera),
      rotation_(motion.R_reference_other),
      omega_(motion.rotation_vector()),
      kind_(derotation == Derotation::image ? Kind::none
            : model == Model::exact         ? Kind::exact
                                            : Kind::first_order) {}

Derotator::Derotator(const Camera& camera, const Eigen::Matrix3d& R_left)
    : camera_(camera), rotation_(R_left), omega_(rotation_log(R_left)), kind_(Kind::exact) {}

Eigen::Vector2d Derotator::operator()(const Eigen::Vector2d& p, const Eigen::Vector2d& w) const {
  switch (kind_) {
    case Kind::none:
      return w;
    case Kind::exact: {
      const Eigen::Vector2d q = p + w;
      const Eigen::Vector3d b = rotation_ * Eigen::Vector3d(q.x() / camera_.fx, q.y() / camera_.fy, 1);
      if (!(b.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
      return Eigen::Vector2d(camera_.fx * b.x() / b.z(), camera_.fy * b.y() / b.z()) - p;
    }
    case Kind::first_order:
      break;
  }
  return w + times_B(camera_, p, omega_);
}

Eigen::Vector2d times_A(const Camera& camera, const Eigen::Vector2d& p, const Eigen::Vector3d& t) {
  return {camera.fx * t.x() - p.x() * t.z(), camera.fy * t.y() - p.y() * t.z()};
}

Eigen::Vector2d times_B(const Camera& camera, const Eigen::Vector2d& p, const Eigen::Vector3d& omega) {
  const double u = p.x() / camera.fx;
  const double v = p.y() / camera.fy;
  return {camera.fx * (-u * v * omega.x() + (1 + u * u) * omega.y() - v * omega.z()),
          camera.fy * (-(1 + v * v) * omega.x() + u * v * omega.y() + u * omega.z())};
}

}  // namespace pade::depth
