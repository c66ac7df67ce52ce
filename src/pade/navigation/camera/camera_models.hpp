// What two images should show of the motion between two poses of the body, and how that follows their errors
// (docs/navigation.md, section 9). Pure functions, held against a numeric Jacobian.
#pragma once

#include "pade/navigation/camera/camera_state.hpp"

namespace pade::navigation {

/// The camera at an earlier moment seen from now.
struct CameraPrediction {
  Pose T_2_1;          ///< of the cameras
  Matrix6d by_anchor;  ///< derivative of (translation, rotation) by (φ, ρ) of the body at the anchor
  Matrix6d by_now;     ///< by (φ, ρ) of the body now
  Eigen::Matrix<double, 6, 3> by_mounting;  ///< by μ
};

/// @param now  T_world_body. @param T_body_camera  as calibrated
inline CameraPrediction predict_camera_motion(const CameraState& camera, const Pose& now,
                                              const Pose& T_body_camera) {
  const Pose mounted = camera.mounted(T_body_camera);
  const Pose T_camera_body = mounted.inverse();
  const Pose body = now.inverse() * camera.anchor;
  CameraPrediction y;
  y.T_2_1 = T_camera_body * body * mounted;
  // T_2_1 = exp(e) T̂_2_1 with e = Ad(T_cb) (Ad(T_21) ξ_1 - ξ_2) + (Ad(T̂_2_1) - I) μ, ordered (φ, ρ).
  Matrix6d to_motion = Matrix6d::Zero();  // (φ, ρ) to (dt, dθ): dt = ρ + φ x t
  to_motion.topLeftCorner<3, 3>() = -skew(y.T_2_1.translation);
  to_motion.topRightCorner<3, 3>().setIdentity();
  to_motion.bottomLeftCorner<3, 3>().setIdentity();
  const Matrix6d of_body = to_motion * adjoint(T_camera_body);
  y.by_anchor = of_body * adjoint(body);
  y.by_now = -of_body;
  y.by_mounting = to_motion * (adjoint(y.T_2_1) - Matrix6d::Identity()).leftCols<3>();
  return y;
}

/// The turn from one direction to another as a vector across the first, of the angle's length.
inline Vector3d turn_between(const Vector3d& from, const Vector3d& to) {
  const double along = from.dot(to);
  const Vector3d across = to - along * from;
  const double sine = across.norm();
  constexpr double kNone = 1e-12;
  if (sine > kNone) return std::atan2(sine, along) / sine * across;
  if (along > 0) return Vector3d::Zero();
  return EIGEN_PI * from.unitOrthogonal();
}

}  // namespace pade::navigation
