// Removing the camera's rotation: from an image by a homography, or from a flow vector.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/depth/depth_options.hpp"

namespace pade::depth {

/// The other image as a camera in its place but with the reference's orientation would have seen it. Flow
/// from the reference to it is derotated flow D.
/// @param image  CV_8UC1 or CV_8UC3 of the other frame, undistorted, of the camera's size.
/// @param camera Undistorted pinhole. @param motion Only R_reference_other is used.
/// Pixels that the other image does not see repeat its border, so that they make no false edge.
cv::Mat derotate_image(const cv::Mat& image, const Camera& camera, const RelativeMotion& motion);

/// Derotated flow of single pixels, in double precision: the reference of the vectorised kernel.
class Derotator {
 public:
  /// @param camera      undistorted pinhole. @param motion  its rotation is what is removed.
  /// @param model       exact: by the rotation matrix; instantaneous: by B omega.
  /// @param derotation  image: the flow is already derotated and passes through.
  Derotator(const Camera& camera, const RelativeMotion& motion, Model model, Derotation derotation);
  /// Exact, by the rotation that is left in the flow.
  Derotator(const Camera& camera, const Eigen::Matrix3d& R_left);

  /// @param p  Pixel of the reference relative to the principal point. @param w  Flow from the reference to
  /// the other image, px. @return D = f b'_xy / b'_z - p with b' = R (p + w)/f (exact; NaN where b'_z <= 0),
  /// or d = w + B omega (instantaneous).
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& p, const Eigen::Vector2d& w) const;

 private:
  Camera camera_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d omega_;
  enum class Kind { none, exact, first_order } kind_;
};

/// Matrix A of Eq. 1 times t at pixel p (relative to the principal point).
Eigen::Vector2d times_A(const Camera& camera, const Eigen::Vector2d& p, const Eigen::Vector3d& t);
/// Matrix B of Eq. 1 times omega at pixel p (relative to the principal point).
Eigen::Vector2d times_B(const Camera& camera, const Eigen::Vector2d& p, const Eigen::Vector3d& omega);

}  // namespace pade::depth
