// One image with its time and pose: what walks through the pipeline.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"

namespace pade {

/// An undistorted image, when it was taken, and from where.
struct Frame {
  Time time;            ///< when it was taken
  cv::Mat image;        ///< CV_8UC1 (grey) or CV_8UC3 (BGR)
  Pose T_world_camera;  ///< camera x right, y down, z forward; metres
  /// Of the motion from the frame before to this one, as RelativeMotion has it with the one before as
  /// reference; zero = exact.
  Matrix6d motion_covariance = Matrix6d::Zero();
};

/// Covariance of a motion over frames that were left out too: what is wrong with one step, a velocity or a
/// yaw, is wrong with the next.
/// @param covariance  of one step. @param missed  frames that were left out
inline Matrix6d over_missed(const Matrix6d& covariance, int missed) {
  const double steps = missed + 1;
  return steps * steps * covariance;
}

}  // namespace pade
