// The little of Lie group theory that the filter uses: SO(3) and the extended poses SE_2(3) of Barrau and
// Bonnabel ("The invariant extended Kalman filter as a stable observer", IEEE TAC 2017). Notation:
// docs/navigation.md.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/pose.hpp"

namespace pade::navigation {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;  ///< (rotation, velocity, position)
using Matrix9d = Eigen::Matrix<double, 9, 9>;  ///< in the order of Vector9d

/// [v]x: skew(a) * b = a x b.
inline Matrix3d skew(const Vector3d& v) {
  return (Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// J_l(φ) of SO(3): Exp(φ + δ) = Exp(J_l δ) Exp(φ) to first order; also the V of SE_2(3).
inline Matrix3d left_jacobian(const Vector3d& phi) {
  const Matrix3d hat = skew(phi);
  const double a2 = phi.squaredNorm();
  // The series is exact to 1e-13 below its limit, the closed form loses digits there.
  if (a2 < 1e-4) return Matrix3d::Identity() + (0.5 - a2 / 24) * hat + (1.0 / 6 - a2 / 120) * hat * hat;
  const double a = std::sqrt(a2);
  return Matrix3d::Identity() + (1 - std::cos(a)) / a2 * hat + (a - std::sin(a)) / (a2 * a) * hat * hat;
}

/// J_r(φ) = J_l(-φ): Exp(φ + δ) = Exp(φ) Exp(J_r δ) to first order.
inline Matrix3d right_jacobian(const Vector3d& phi) { return left_jacobian(-phi); }

/// An element of SE_2(3): rotation, velocity and position of the body in the world.
struct ExtendedPose {
  Quaterniond R = Quaterniond::Identity();  ///< R_world_body, unit norm
  Vector3d v = Vector3d::Zero();            ///< velocity in the world, m/s
  Vector3d p = Vector3d::Zero();            ///< position in the world, m

  /// The group's product, that of the 5x5 matrices [R v p; 0 1 0; 0 0 1].
  ExtendedPose operator*(const ExtendedPose& other) const {
    return {(R * other.R).normalized(), v + R * other.v, p + R * other.p};
  }
  /// X^-1 in that group: X * X.inverse() is the identity.
  [[nodiscard]] ExtendedPose inverse() const {
    return {R.conjugate(), -(R.conjugate() * v), -(R.conjugate() * p)};
  }

  /// exp of ξ = (φ, ν, ρ): rotation, velocity, position.
  static ExtendedPose exp(const Vector9d& xi) {
    const Matrix3d V = left_jacobian(xi.head<3>());
    return {rotation_exp(xi.head<3>()), V * xi.segment<3>(3), V * xi.tail<3>()};
  }
  /// ξ with exp(ξ) = *this; rotation angle in [0, pi].
  [[nodiscard]] Vector9d log() const {
    Vector9d xi;
    xi.head<3>() = rotation_log(R);
    const Matrix3d V_inverse = left_jacobian(xi.head<3>()).inverse();
    xi.segment<3>(3) = V_inverse * v;
    xi.tail<3>() = V_inverse * p;
    return xi;
  }

  /// Ad: X exp(ξ) X^-1 = exp(Ad ξ).
  [[nodiscard]] Matrix9d adjoint() const {
    const Matrix3d rotation = R.toRotationMatrix();
    Matrix9d Ad = Matrix9d::Zero();
    Ad.block<3, 3>(0, 0) = Ad.block<3, 3>(3, 3) = Ad.block<3, 3>(6, 6) = rotation;
    Ad.block<3, 3>(3, 0) = skew(v) * rotation;
    Ad.block<3, 3>(6, 0) = skew(p) * rotation;
    return Ad;
  }
};

/// Ad of SE(3) for errors ordered (rotation, translation).
inline Matrix6d adjoint(const Pose& T) {
  const Matrix3d rotation = T.matrix3();
  Matrix6d Ad = Matrix6d::Zero();
  Ad.block<3, 3>(0, 0) = Ad.block<3, 3>(3, 3) = rotation;
  Ad.block<3, 3>(3, 0) = skew(T.translation) * rotation;
  return Ad;
}

}  // namespace pade::navigation
