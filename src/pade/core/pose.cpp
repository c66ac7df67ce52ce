#include "pade/core/pose.hpp"

#include <cmath>

namespace pade {
namespace {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// V(φ) of SE(3): the translation of exp(ρ, φ) is V(φ) ρ.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const Eigen::Matrix3d hat = skew(phi);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + 0.5 * hat + hat * hat / 6.0;
  const double a2 = angle * angle;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / a2 * hat +
         (angle - std::sin(angle)) / (a2 * angle) * hat * hat;
}

}  // namespace

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation.conjugate();
  return {inverse_rotation, -(inverse_rotation * translation)};
}

Pose Pose::operator*(const Pose& other) const {
  return {(rotation * other.rotation).normalized(), translation + rotation * other.translation};
}

Eigen::Vector3d Pose::operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }

bool Pose::is_finite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }

Eigen::Vector3d rotation_log(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;  // q and -q are one rotation; take the short way round
  const Eigen::Vector3d vector = sign * rotation.vec();
  const double sine = vector.norm();
  const double cosine = sign * rotation.w();
  if (sine < 1e-9) return 2 * vector;
  return 2 * std::atan2(sine, cosine) / sine * vector;
}

Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation) {
  return rotation_log(Eigen::Quaterniond(rotation));
}

Eigen::Quaterniond rotation_exp(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  const double scale = angle < 1e-9 ? 0.5 : std::sin(0.5 * angle) / angle;
  const Eigen::Vector3d v = scale * rotation_vector;
  return Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

Pose interpolate(const Pose& a, const Pose& b, double s) {
  const Pose step = a.inverse() * b;
  const Eigen::Vector3d phi = rotation_log(step.rotation);
  const Eigen::Vector3d rho = left_jacobian(phi).inverse() * step.translation;
  return a * Pose{rotation_exp(s * phi), left_jacobian(s * phi) * (s * rho)};
}

RelativeMotion reversed(const RelativeMotion& motion) {
  // t' = -R^T t and R' = R^T: dt' = -R^T (dt + t x dθ), dθ' = -R^T dθ.
  RelativeMotion reverse;
  const Eigen::Matrix3d Rt = motion.R_reference_other.transpose();
  reverse.R_reference_other = Rt;
  reverse.t_reference_other = -Rt * motion.t_reference_other;
  reverse.duration = -motion.duration;
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = -Rt;
  J.topRightCorner<3, 3>() = -Rt * skew(motion.t_reference_other);
  reverse.covariance = J * motion.covariance * J.transpose();
  return reverse;
}

RelativeMotion relative_motion(const Pose& T_world_reference, const Pose& T_world_other, double duration) {
  const Pose T_reference_other = T_world_reference.inverse() * T_world_other;
  RelativeMotion motion;
  motion.R_reference_other = T_reference_other.matrix3();
  motion.t_reference_other = T_reference_other.translation;
  motion.duration = duration;
  return motion;
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Matrix3d forward_camera_rotation() {
  return (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
}

}  // namespace pade
