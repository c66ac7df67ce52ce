// What a vehicle on wheels measures of its own motion in the plane: a plain value.
#pragma once

#include "pade/core/time.hpp"

namespace pade {

/// Speed and yaw rate at one moment. Body frame FLU.
struct PlanarOdometry {
  Time time;                      ///< of the measurement
  double speed = 0;               ///< along the body's x axis, m/s
  double yaw_rate = 0;            ///< about the body's z axis, rad/s
  double speed_sigma = 0.05;      ///< of the noise of one sample, m/s
  double yaw_rate_sigma = 0.002;  ///< likewise, rad/s
};

}  // namespace pade
