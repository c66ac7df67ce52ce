// The state of the filter and its error, one notation for code and docs/navigation.md.
//
// Error (22): φ rotation, ν velocity, ρ position (left-invariant: X = X̂ exp(ξ), so all in body axes), then
// δb_g, δb_a, δb_p (GNSS position bias, ENU), δb_h (barometer zero) and δh (the vehicle's iron), additive.
#pragma once

#include "pade/core/lie.hpp"
#include "pade/core/time.hpp"

namespace pade::navigation {

inline constexpr int kPhi = 0;
inline constexpr int kNu = 3;
inline constexpr int kRho = 6;
inline constexpr int kGyroscopeBias = 9;
inline constexpr int kAccelerometerBias = 12;
inline constexpr int kCore = 15;
inline constexpr int kPositionBias = 15;
inline constexpr int kHeightBias = 18;
inline constexpr int kIron = 19;
inline constexpr int kBase = 22;

// Behind them, if raw GNSS is expected (tight/raw_state.hpp): the receiver's clock and its drift, in metres
// of GPS's time and m/s; what the signals of GLONASS, Galileo and BeiDou are late against GPS's, m; and a
// copy of the antenna's position (ENU) and of the clock at the epoch from which the carriers' phases are
// counted. All additive.
inline constexpr int kClock = 22;
inline constexpr int kDrift = 23;
inline constexpr int kSystemBias = 24;
inline constexpr int kAnchorPosition = 27;
inline constexpr int kAnchorClock = 30;
inline constexpr int kRawStates = 9;

using BaseVector = Eigen::Matrix<double, kBase, 1>;
using BaseMatrix = Eigen::Matrix<double, kBase, kBase>;

/// The estimate without its covariance.
struct NavigationState {
  Time time;
  ExtendedPose X;                                  ///< T_world_body and the velocity, ENU
  Vector3d gyroscope_bias = Vector3d::Zero();      ///< rad/s
  Vector3d accelerometer_bias = Vector3d::Zero();  ///< m/s²
  Vector3d position_bias = Vector3d::Zero();       ///< of GNSS positions, ENU, m
  double height_zero = 0;                          ///< of the barometer as it began, ENU, m
  double height_bias = 0;                          ///< what that has drifted by, m
  Vector3d iron = Vector3d::Zero();          ///< field of the vehicle, body, as a share of the whole field
  Vector3d angular_rate = Vector3d::Zero();  ///< bias-corrected, at `time`, for lever arms

  /// Moves the estimate by an error: X exp(ξ), biases added.
  void retract(const BaseVector& error) {
    X = X * ExtendedPose::exp(error.head<9>());
    gyroscope_bias += error.segment<3>(kGyroscopeBias);
    angular_rate -= error.segment<3>(kGyroscopeBias);
    accelerometer_bias += error.segment<3>(kAccelerometerBias);
    position_bias += error.segment<3>(kPositionBias);
    height_bias += error[kHeightBias];
    iron += error.segment<3>(kIron);
  }
};

}  // namespace pade::navigation
