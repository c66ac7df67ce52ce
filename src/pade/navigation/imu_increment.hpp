// Inertial increments between two updates of the filter: the motion itself, its sensitivity to the biases,
// and its noise, accumulated sample by sample (Barrau and Bonnabel, "A mathematical framework for IMU error
// propagation with applications to preintegration", ICRA 2020; docs/navigation.md, section 2).
#pragma once

#include "pade/core/lie.hpp"

namespace pade::navigation {

/// Υ, the factor on the right of X(t) = Γ(t) Φ_t(X(0)) Υ(t), and the error that it brings.
struct ImuIncrement {
  Matrix3d R = Matrix3d::Identity();
  Vector3d v = Vector3d::Zero();
  Vector3d p = Vector3d::Zero();
  double duration = 0;                                                              ///< s
  Eigen::Matrix<double, 9, 6> bias_jacobian = Eigen::Matrix<double, 9, 6>::Zero();  ///< dξ / d(b_g, b_a)
  Matrix9d noise = Matrix9d::Zero();  ///< covariance of ξ from white noise

  /// Transition of the left-invariant error over the increment: Ad(Υ^-1) F(T), with F: ρ <- ρ + T ν.
  [[nodiscard]] Matrix9d transition() const;
};

/// Υ of one interval in which the bias-corrected angular rate and specific force are constant in the body,
/// and how the left-invariant error of Υ follows errors of the two.
struct ImuStep {
  Matrix3d R;
  Vector3d v;
  Vector3d p;
  Eigen::Matrix<double, 9, 6> input_jacobian;  ///< dξ / d(rate, force)
};

/// Series in the rotation θ of the interval, up to θ²; what is left out is θ³/24 of the velocity (3e-7 at 200
/// °/s and 200 Hz).
ImuStep imu_step(const Vector3d& rate, const Vector3d& force, double dt);

/// Υ <- Φ_dt(Υ) Υ_step, with the sensitivities. `rate_power`, `force_power`: white noise per axis, unit²/Hz.
void accumulate(ImuIncrement& increment, const ImuStep& step, double dt, const Vector3d& rate_power,
                const Vector3d& force_power);

}  // namespace pade::navigation
