#include "pade/paper/misreadings.hpp"

#include <cmath>

namespace pade::experiment {
namespace {

/// Yaw, pitch and roll (about z, y, x, in this order) of the body whose forward camera has this pose, as the
/// rates (roll, pitch, yaw) are counted.
Eigen::Vector3d roll_pitch_yaw(const Pose& T_world_camera) {
  const Eigen::Matrix3d R = T_world_camera.matrix3() * forward_camera_rotation().transpose();
  return {std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)),
          std::atan2(R(1, 0), R(0, 0))};
}

double wrapped(double angle) { return std::remainder(angle, 2 * M_PI); }

/// The difference of the angles taken for the rotation between the frames, about the camera's own axes.
Eigen::Matrix3d euler_difference(const Pose& T_world_reference, const Pose& T_world_other) {
  const Eigen::Vector3d from = roll_pitch_yaw(T_world_reference);
  const Eigen::Vector3d to = roll_pitch_yaw(T_world_other);
  const Eigen::Vector3d body(wrapped(to.x() - from.x()), wrapped(to.y() - from.y()),
                             wrapped(to.z() - from.z()));
  return rotation_exp(forward_camera_rotation().transpose() * body).toRotationMatrix();
}

}  // namespace

RelativeMotion misread(const RelativeMotion& motion, const Pose& T_world_reference, const Pose& T_world_other,
                       Misreading misreading) {
  RelativeMotion read = motion;
  switch (misreading) {
    case Misreading::none:
    case Misreading::without_tz:
      break;
    case Misreading::signs_of_eq1:
      read.t_reference_other = -motion.t_reference_other;
      read.R_reference_other = motion.R_reference_other.transpose();
      break;
    case Misreading::sign_of_rotation:
      read.R_reference_other = motion.R_reference_other.transpose();
      break;
    case Misreading::world_translation:
      read.t_reference_other = T_world_other.translation - T_world_reference.translation;
      break;
    case Misreading::euler_difference:
      read.R_reference_other = euler_difference(T_world_reference, T_world_other);
      break;
    case Misreading::avionics_names: {
      const Eigen::Vector3d omega = motion.rotation_vector();  // about x pitch, y yaw, z roll
      read.R_reference_other = rotation_exp({omega.z(), omega.x(), omega.y()}).toRotationMatrix();
      break;
    }
  }
  return read;
}

void misread(DepthImage& depth, const RelativeMotion& motion, Misreading misreading) {
  if (misreading == Misreading::without_tz) depth.depth -= motion.t_reference_other.z();
}

}  // namespace pade::experiment
