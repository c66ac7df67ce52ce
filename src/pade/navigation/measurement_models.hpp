// What each sensor should show in a given state, and how that follows the error of the state
// (docs/navigation.md, section 3). Pure functions: one generic test holds each Jacobian against a numeric
// one.
#pragma once

#include <optional>

#include "pade/navigation/filter_state.hpp"

namespace pade::navigation {

template <int M>
struct Prediction {
  Eigen::Matrix<double, M, 1> value;
  Eigen::Matrix<double, M, kBase> H;  ///< d value / d error, at error zero
};

/// Antenna position as the receiver shows it: p + R l + b_p.
inline Prediction<3> predict_gnss_position(const NavigationState& state, const Vector3d& lever_arm) {
  const Matrix3d R = state.X.R.toRotationMatrix();
  Prediction<3> y;
  y.value = state.X.p + R * lever_arm + state.position_bias;
  y.H.setZero();
  y.H.middleCols<3>(kPhi) = -R * skew(lever_arm);
  y.H.middleCols<3>(kRho) = R;
  y.H.middleCols<3>(kPositionBias).setIdentity();
  return y;
}

/// Antenna velocity: v + R (ω x l); ω follows the gyroscope bias.
inline Prediction<3> predict_gnss_velocity(const NavigationState& state, const Vector3d& lever_arm) {
  const Matrix3d R = state.X.R.toRotationMatrix();
  const Vector3d swing = state.angular_rate.cross(lever_arm);
  Prediction<3> y;
  y.value = state.X.v + R * swing;
  y.H.setZero();
  y.H.middleCols<3>(kPhi) = -R * skew(swing);
  y.H.middleCols<3>(kNu) = R;
  y.H.middleCols<3>(kGyroscopeBias) = R * skew(lever_arm);
  return y;
}

/// Velocity of the body origin (zero-velocity updates).
inline Prediction<3> predict_velocity(const NavigationState& state) {
  return predict_gnss_velocity(state, Vector3d::Zero());
}

/// Velocity to the side and upwards in the body frame, (R^T v)_yz.
inline Prediction<2> predict_road_motion(const NavigationState& state) {
  const Vector3d u = state.X.R.conjugate() * state.X.v;
  Prediction<2> y;
  y.value = u.tail<2>();
  y.H.setZero();
  y.H.middleCols<3>(kPhi) = skew(u).bottomRows<2>();
  y.H.middleCols<3>(kNu) = Matrix3d::Identity().bottomRows<2>();
  return y;
}

/// Barometric height: p_z + b_h.h.
inline Prediction<1> predict_barometric_height(const NavigationState& state) {
  Prediction<1> y;
  y.value[0] = state.X.p.z() + state.height_zero + state.height_bias;
  y.H.setZero();
  y.H.middleCols<3>(kRho) = state.X.R.toRotationMatrix().row(2);
  y.H(0, kHeightBias) = 1;
  return y;
}

/// Azimuth of a body vector `b`, from east towards north; none if it points straight up or down.
inline std::optional<Prediction<1>> predict_azimuth(const NavigationState& state, const Vector3d& b) {
  const Matrix3d R = state.X.R.toRotationMatrix();
  const Vector3d w = R * b;
  const double horizontal = w.head<2>().squaredNorm();
  if (horizontal < 1e-4 * b.squaredNorm()) return std::nullopt;
  Prediction<1> y;
  y.value[0] = std::atan2(w.y(), w.x());
  y.H.setZero();
  y.H.middleCols<3>(kPhi) = Eigen::RowVector3d(-w.y(), w.x(), 0) / horizontal * (-R * skew(b));
  return y;
}

/// Azimuth of the Earth's field, what a magnetometer shows less what the vehicle's iron adds; `field`: of
/// norm 1.
inline std::optional<Prediction<1>> predict_magnetic_azimuth(const NavigationState& state,
                                                             const Vector3d& field) {
  auto y = predict_azimuth(state, field - state.iron);
  if (!y) return y;
  const Matrix3d R = state.X.R.toRotationMatrix();
  const Vector3d w = R * (field - state.iron);
  y->H.middleCols<3>(kIron) = Eigen::RowVector3d(w.y(), -w.x(), 0) / w.head<2>().squaredNorm() * R;
  return y;
}

/// Distance along body -z to level ground at height h: (p_z - h) / R_zz; none if the body is tilted over
/// 60°.
inline std::optional<Prediction<1>> predict_range(const NavigationState& state, double ground_height) {
  const Matrix3d R = state.X.R.toRotationMatrix();
  const double cosine = R(2, 2);
  if (cosine < 0.5) return std::nullopt;
  Prediction<1> y;
  y.value[0] = (state.X.p.z() - ground_height) / cosine;
  y.H.setZero();
  y.H.middleCols<3>(kRho) = R.row(2) / cosine;
  const Eigen::RowVector3d dcosine = -R.row(2) * skew(Vector3d::UnitZ());
  y.H.middleCols<3>(kPhi) = -y.value[0] / cosine * dcosine;
  return y;
}

/// Specific force of an unaccelerated body: -R^T g + b_a, with gravity along world -z (levelling).
inline Prediction<3> predict_static_force(const NavigationState& state, double gravity) {
  const Vector3d up = state.X.R.conjugate() * Vector3d(0, 0, gravity);
  Prediction<3> y;
  y.value = up + state.accelerometer_bias;
  y.H.setZero();
  y.H.middleCols<3>(kPhi) = skew(up);
  y.H.middleCols<3>(kAccelerometerBias).setIdentity();
  return y;
}

}  // namespace pade::navigation
