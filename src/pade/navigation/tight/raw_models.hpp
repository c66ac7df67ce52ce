// What a satellite should show (docs/navigation.md, section 7), as functions of the few variables that they
// depend on. Pure functions: the Jacobians are held against numeric ones.
#pragma once

#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/navigation/tight/raw_state.hpp"

namespace pade::navigation {

// The variables: antenna's position, velocity, common bias of the ranges, then the nine errors of the
// receiver.
inline constexpr int kOfPosition = 0;
inline constexpr int kOfVelocity = 3;
inline constexpr int kOfBias = 6;
inline constexpr int kOfReceiver = 9;
inline constexpr int kRawVariables = kOfReceiver + kRawStates;

using RawRow = Eigen::Matrix<double, kRawVariables, 1>;                 ///< a derivative
using RawMatrix = Eigen::Matrix<double, kRawVariables, kRawVariables>;  ///< a covariance

/// All that raw measurements depend on; ENU, m and m/s.
struct RawVariables {
  Vector3d position = Vector3d::Zero();  ///< of the antenna, by the IMU's clock
  Vector3d velocity = Vector3d::Zero();
  Vector3d position_bias = Vector3d::Zero();
  ReceiverState receiver;

  void retract(const RawRow& error) {
    position += error.segment<3>(kOfPosition);
    velocity += error.segment<3>(kOfVelocity);
    position_bias += error.segment<3>(kOfBias);
    receiver.retract(error.segment<kRawStates>(kOfReceiver));
  }
  /// Where the antenna was at the epoch: by a clock that is ahead the epoch is stamped late.
  [[nodiscard]] Vector3d sampled_at() const {
    return position - receiver.clock / gnss::kSpeedOfLight * velocity;
  }
};

/// A scalar prediction and its derivative.
struct RawPrediction {
  double value = 0;
  RawRow row = RawRow::Zero();
};

/// Distance from the antenna, moved by the common bias; clock and bias of the satellite's system.
inline RawPrediction predict_range(const RawVariables& x, const RawSatellite& satellite) {
  const Vector3d d = satellite.position - x.sampled_at() - x.position_bias;
  const Vector3d u = d.normalized();
  const double late = x.receiver.clock / gnss::kSpeedOfLight;
  RawPrediction y;
  y.value = d.norm() + x.receiver.clock;
  y.row.segment<3>(kOfPosition) = y.row.segment<3>(kOfBias) = -u;
  y.row.segment<3>(kOfVelocity) = late * u;
  y.row[kOfReceiver] = 1 + u.dot(x.velocity) / gnss::kSpeedOfLight;
  const auto system = static_cast<int>(satellite.satellite.system);
  if (system > 0) {
    y.value += x.receiver.system_bias[system - 1];
    y.row[kOfReceiver + 1 + system] = 1;
  }
  return y;
}

/// Change of the distance by the time of reception, and the clock's drift.
inline RawPrediction predict_rate(const RawVariables& x, const RawSatellite& satellite) {
  const Vector3d d = satellite.position - x.position;
  const Vector3d u = d.normalized();
  const double sent = u.dot(satellite.velocity);
  const double stretch = 1 / (1 + sent / gnss::kSpeedOfLight);
  const Vector3d apart = satellite.velocity - x.velocity;
  RawPrediction y;
  y.value = u.dot(apart) * stretch + x.receiver.drift;
  y.row.segment<3>(kOfPosition) = -(apart - u * u.dot(apart)) / d.norm();
  y.row.segment<3>(kOfVelocity) = -u * stretch;
  y.row[kOfReceiver + 1] = 1;
  return y;
}

/// Change of the distance and of the clock since the anchor.
inline RawPrediction predict_phase_change(const RawVariables& x, const RawSatellite& satellite,
                                          const AnchoredPhase& anchor) {
  const Vector3d d = satellite.position - x.sampled_at();
  const Vector3d u = d.normalized();
  const Vector3d d0 = anchor.position - x.receiver.anchor_position;
  const double late = x.receiver.clock / gnss::kSpeedOfLight;
  RawPrediction y;
  y.value = d.norm() - d0.norm() + x.receiver.clock - x.receiver.anchor_clock;
  y.row.segment<3>(kOfPosition) = -u;
  y.row.segment<3>(kOfVelocity) = late * u;
  y.row[kOfReceiver] = 1 + u.dot(x.velocity) / gnss::kSpeedOfLight;
  y.row.segment<3>(kOfReceiver + 5) = d0.normalized();
  y.row[kOfReceiver + 8] = -1;
  return y;
}

}  // namespace pade::navigation
