// What navigation sensors deliver: plain values, stamped at the moment of measurement. Body frame FLU (x
// forward, y left, z up), world frame local ENU (x east, y north, z up), SI units, radians.
#pragma once

#include <Eigen/Core>

#include "pade/core/time.hpp"

namespace pade {

/// One sample of a strapdown inertial measurement unit, at the body origin.
struct ImuSample {
  Time time;  ///< of the measurement
  Eigen::Vector3d angular_rate =
      Eigen::Vector3d::Zero();  ///< of the body against the world, body axes, rad/s
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();  ///< acceleration minus gravity, body axes, m/s²
};

/// A GNSS position of the antenna.
struct GnssFix {
  Time time;                                                 ///< of the measurement
  Eigen::Vector3d position = Eigen::Vector3d::Zero();        ///< antenna, ENU, m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< total error as the receiver reports it, m²
};

/// A GNSS velocity of the antenna (from Doppler or carrier differences); it has its own stamp.
struct GnssVelocity {
  Time time;                                                 ///< of the measurement
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();        ///< antenna, ENU, m/s
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< (m/s)²
};

/// A component of a GNSS velocity with this sigma or a larger one is not measured, m/s.
inline constexpr double unmeasured_velocity = 5;
/// 1 for the components that are measured (east, north, up), 0 for the others: many receivers report course
/// and speed over ground alone.
inline Eigen::Vector3d measured_axes(const GnssVelocity& velocity) {
  constexpr double kVariance = unmeasured_velocity * unmeasured_velocity;
  return (velocity.covariance.diagonal().array() < kVariance).cast<double>();
}

/// A barometric height above an unknown, slowly drifting zero.
struct BarometricHeight {
  Time time;          ///< of the measurement
  double height = 0;  ///< up, m
  double sigma = 1;   ///< white part, m
};

/// The Earth's magnetic field in body axes.
struct MagneticField {
  Time time;                                        ///< of the measurement
  Eigen::Vector3d field = Eigen::Vector3d::Zero();  ///< body axes, any unit
  double sigma = 0.006;  ///< white part per axis, as a fraction of the field's norm
};

/// The yaw of the body: angle of its x axis from east, towards north.
struct Heading {
  Time time;           ///< of the measurement
  double yaw = 0;      ///< rad
  double sigma = 0.1;  ///< rad
};

/// The vehicle is known to stand still.
struct ZeroVelocity {
  Time time;            ///< of the measurement
  double sigma = 0.02;  ///< per axis, m/s
};

/// A vehicle on wheels moves along its x axis: no part of the velocity points to its side or off the road.
struct RoadMotion {
  Time time;           ///< of the measurement
  double sigma = 0.2;  ///< per axis, m/s; what the wheels slip and the springs move
};

/// Distance along body -z to level ground.
struct RangeToGround {
  Time time;                 ///< of the measurement
  double range = 0;          ///< m
  double sigma = 0.05;       ///< m
  double ground_height = 0;  ///< of the ground below, ENU, m
};

}  // namespace pade
