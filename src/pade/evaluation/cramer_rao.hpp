// How good depth from two frames can get: the Cramér-Rao bound of the exact two-view model (docs/method.md,
// "Two views of a point"), to hold measured errors against.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"

namespace pade::evaluation {

/// Standard deviations of independent errors of the relative pose, per axis of the reference camera.
struct PoseNoise {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();     ///< rotation vector, rad

  /// Both zero: the pose is exact.
  [[nodiscard]] bool is_zero() const { return translation.isZero(0) && rotation.isZero(0); }
};

/// The pose noise of `level` per component of the motion, uniform in ± level (0.2 = 20 %): a component p has
/// the standard deviation level |p| / sqrt(3).
PoseNoise uniform_noise(const RelativeMotion& motion, double level);

/// The least standard deviation of depth per pixel that an unbiased estimate from two frames can have,
///   sigma_Z² = (Z - t_z)^4 sigma² / |a|² + J Sigma J^T,   a = -A t.
/// The first part is the Cramér-Rao bound for derotated flow with independent normal noise. The second is
/// pose noise as it enters through Z = (a.a)/(a.D) + t_z where the pose is taken as given; whoever corrects
/// the pose from the image can go below that part. The covariance of `motion` is not used.
/// @param camera      undistorted pinhole, of the size of `true_depth`.
/// @param motion      of the pair, seen from the frame of `true_depth`; any order of the two frames.
/// @param true_depth  CV_32FC1 metres along the optical axis. @param sigma_px  per component of flow, px.
/// @return CV_32FC1 metres. NaN where two frames have no answer: no truth, at the epipole (a = 0) and behind
/// the other camera (Z <= t_z). Pixels that the other image does not see have a bound all the same.
cv::Mat depth_bound(const Camera& camera, const RelativeMotion& motion, const cv::Mat& true_depth,
                    double sigma_px, const PoseNoise& noise = {});

}  // namespace pade::evaluation
