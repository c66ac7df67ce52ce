// Rigid motions. `T_a_b` maps coordinates in frame b to coordinates in frame a: p_a = T_a_b * p_b.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/time.hpp"

namespace pade {

using Vector6d = Eigen::Matrix<double, 6, 1>;  ///< (translation, rotation vector)
using Matrix6d = Eigen::Matrix<double, 6, 6>;  ///< in the order of Vector6d

/// A rigid transform T_a_b (rotation, then translation). As a camera pose it is T_world_camera: camera x
/// right, y down, z forward; metres.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit norm, Hamilton
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         ///< origin of b in a, metres

  [[nodiscard]] Pose inverse() const;                             ///< T_b_a
  Pose operator*(const Pose& other) const;                        ///< T_a_c = T_a_b * T_b_c
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;  ///< p_a = T_a_b * p_b
  /// The rotation as a matrix R_a_b.
  [[nodiscard]] Eigen::Matrix3d matrix3() const { return rotation.toRotationMatrix(); }
  /// False if any number is NaN or infinite.
  [[nodiscard]] bool is_finite() const;
};

/// Rotation vector (axis times angle in [0, pi]) of a rotation: the logarithm of SO(3).
Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation);
Eigen::Vector3d rotation_log(const Eigen::Quaterniond& rotation);  ///< of a unit quaternion
/// The rotation of a rotation vector: the exponential of SO(3).
Eigen::Quaterniond rotation_exp(const Eigen::Vector3d& rotation_vector);
/// The least rotation that turns the direction of `from` into that of `to`; neither is zero. It is Eigen's
/// FromTwoVectors, compiled once because it takes long.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The pose a fraction `s` in [0, 1] of the way from `a` to `b` at constant body velocity on SE(3):
/// a * exp(s log(a^-1 b)).
Pose interpolate(const Pose& a, const Pose& b, double s);

/// Motion between the two frames of a pair, seen from the frame on whose pixels the depth lives (the
/// reference). With the newest frame k+1 as reference, `other` is frame k; in the paper's order it is the
/// reverse.
struct RelativeMotion {
  Eigen::Matrix3d R_reference_other = Eigen::Matrix3d::Identity();  ///< directions: other -> reference
  Eigen::Vector3d t_reference_other =
      Eigen::Vector3d::Zero();  ///< other camera's position in the reference, m
  double duration = 0;  ///< seconds from the reference to the other frame; negative if the other is older
  /// Covariance of (translation, rotation vector), in the reference frame: t + dt, exp(dtheta) R. Zero =
  /// exact.
  Matrix6d covariance = Matrix6d::Zero();

  /// ω = log(R): rotation of the other camera seen from the reference, rad.
  [[nodiscard]] Eigen::Vector3d rotation_vector() const { return rotation_log(R_reference_other); }
};

/// Relative motion from two poses T_world_camera (method: errata 2 and 3 of the paper's Section 2.2).
RelativeMotion relative_motion(const Pose& T_world_reference, const Pose& T_world_other, double duration);

/// The same motion seen from the other frame, with its covariance to first order.
RelativeMotion reversed(const RelativeMotion& motion);

/// T_world_camera of a camera that is mounted on a body: T_world_body * T_body_camera. `T_body_camera` holds
/// the lever arm (translation, body axes) and the camera-to-body rotation.
inline Pose camera_pose(const Pose& T_world_body, const Pose& T_body_camera) {
  return T_world_body * T_body_camera;
}

/// Rotation R_body_camera of a level, forward-looking camera on an FLU body: columns (0,-1,0), (0,0,-1),
/// (1,0,0).
Eigen::Matrix3d forward_camera_rotation();

}  // namespace pade
