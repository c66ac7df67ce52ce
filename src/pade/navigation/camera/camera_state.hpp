// What the filter knows of the camera.
#pragma once

#include "pade/navigation/camera/camera_motion.hpp"

namespace pade::navigation {

// Errors of the camera, behind all others but the clones: (φ, ρ) of the *anchor*, a copy of the pose at the
// last image, and the rotation μ of the camera's mounting, R_body_camera Exp(μ).
inline constexpr int kAnchorPose = 0;
inline constexpr int kMounting = 6;
inline constexpr int kCameraStates = 9;

using CameraVector = Eigen::Matrix<double, kCameraStates, 1>;

/// Of no account unless camera motions are expected.
struct CameraState {
  bool anchored = false;
  Time anchor_time;                                ///< of the image, on the clock of the IMU
  Pose anchor;                                     ///< T_world_body then
  Quaterniond mounting = Quaterniond::Identity();  ///< R_calibrated_camera
  CameraTally tally;

  void retract(const CameraVector& error) {
    const Vector3d phi = error.segment<3>(kAnchorPose);
    anchor = anchor * Pose{rotation_exp(phi), left_jacobian(phi) * error.segment<3>(kAnchorPose + 3)};
    mounting = (mounting * rotation_exp(error.segment<3>(kMounting))).normalized();
  }
  /// T_body_camera of a camera calibrated so, as the filter has it.
  [[nodiscard]] Pose mounted(const Pose& T_body_camera) const {
    return {(T_body_camera.rotation * mounting).normalized(), T_body_camera.translation};
  }
};

}  // namespace pade::navigation
