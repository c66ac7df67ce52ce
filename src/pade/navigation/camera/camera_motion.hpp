// The motion of a camera between two images as these images show it: a measurement of the filter
// (docs/navigation.md, section 9).
#pragma once

#include <cstdint>

#include "pade/core/lie.hpp"
#include "pade/core/time.hpp"

namespace pade::navigation {

/// Rotation and direction of translation between two images, from the images alone: what navigation knew of
/// the motion must not be in it, or the filter counts it twice.
struct CameraMotion {
  Time t1;                                    ///< of the older image, on the clock of the images
  Time t2;                                    ///< of the newer one
  Matrix3d R_2_1 = Matrix3d::Identity();      ///< turns directions of camera 1 into those of camera 2
  Vector3d direction_2_1 = Vector3d::Zero();  ///< of camera 1 seen from camera 2, axes of 2; norm 1
  /// Inverse covariance of (direction_2_1, rotation vector), in the order and axes of
  /// RelativeMotion::covariance with camera 2 as reference and a baseline of length 1: rad^-2. Of rank 5 at
  /// most, as the images tell no length; what they do not tell has zeros.
  Matrix6d information = Matrix6d::Zero();
  Pose T_body_camera;  ///< of the camera on the body, as calibrated
};

/// What became of the camera's motions since the start of the filter.
struct CameraTally {
  std::uint64_t used = 0;  ///< rotation and direction
  std::uint64_t rotation_only =
      0;                         ///< the baseline is too short, as the filter knows it, to have a direction
  std::uint64_t refused = 0;     ///< they do not fit
  std::uint64_t unanchored = 0;  ///< the filter had not started at the older image
};

/// Finite, a rotation, a direction of norm 1, a symmetric information without negative parts, t1 before t2.
[[nodiscard]] bool is_usable(const CameraMotion& motion);

}  // namespace pade::navigation
