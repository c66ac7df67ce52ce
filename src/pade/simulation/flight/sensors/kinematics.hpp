// What a sensor model needs to know of the true motion.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/time.hpp"

namespace pade::simulation {

/// The true motion of the body at one moment. Body FLU, world ENU, SI.
struct KinematicState {
  Time time;
  Eigen::Quaterniond R_world_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< d(velocity)/dt in the world, without gravity
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< body axes
};

}  // namespace pade::simulation
