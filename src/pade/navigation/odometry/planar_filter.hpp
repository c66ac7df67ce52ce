// A vehicle on wheels that has odometry and raw GNSS but no IMU: a Kalman filter whose motion is linear in
// all that is unknown of it, the yaw at the start included (docs/navigation.md, section 8).
#pragma once

#include <cstdint>
#include <vector>

#include "pade/core/sensors/odometry.hpp"
#include "pade/navigation/odometry/planar_options.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/navigation/tight/raw_information.hpp"

namespace pade::navigation {

// The errors: the antenna's position, east, north and up; the heading vector, in the plane; the bias of the
// yaw rate; then the receiver as in filter_state.hpp: clock, drift and the biases of the systems. All
// additive.
inline constexpr int kPlanarHeading = 3;
inline constexpr int kPlanarBias = 5;
inline constexpr int kPlanarReceiver = 6;
inline constexpr int kPlanarClock = 6;
inline constexpr int kPlanarDrift = 7;
inline constexpr int kPlanarSystemBias = 8;
inline constexpr int kPlanarStates = 11;

using PlanarVector = Eigen::Matrix<double, kPlanarStates, 1>;
using PlanarMatrix = Eigen::Matrix<double, kPlanarStates, kPlanarStates>;

/// What is known at one moment.
struct PlanarEstimate {
  Time time;
  Vector3d position = Vector3d::Zero();    ///< of the antenna, ENU, m
  Matrix3d covariance = Matrix3d::Zero();  ///< of it, m²
  double yaw = 0;                          ///< of the body, from east towards north, rad
  double yaw_sigma = 0;                    ///< rad; above `PlanarOptions::yaw_known` while it is not known
  bool yaw_known = false;
  double scale = 1;  ///< true way over measured way; of no account while the yaw is not known
  double scale_sigma = 0;
  double speed = 0;          ///< corrected by the scale, m/s
  double yaw_rate_bias = 0;  ///< measured less true, rad/s
  double clock = 0;          ///< of the receiver, m
  double drift = 0;          ///< m/s
};

/// What a satellite's range counted at an epoch.
struct RangeShare {
  gnss::SatelliteId satellite;
  double share = 0;     ///< of its full weight; 0: refused
  double residual = 0;  ///< that is left, m
};

/// What became of the ranges.
struct PlanarTally {
  std::uint64_t counted = 0;      ///< at half their weight or more
  std::uint64_t doubted = 0;      ///< at less
  std::uint64_t refused = 0;      ///< not at all
  std::uint64_t clock_jumps = 0;  ///< of the receiver's clock, by whole milliseconds
  std::uint64_t reacquired = 0;   ///< times that the satellites were believed against the filter
  std::uint64_t gaps = 0;         ///< in the odometry
  std::uint64_t untimely = 0;     ///< epochs that lie before the filter's time, or repeat it: not used
};

class PlanarFilter {
 public:
  explicit PlanarFilter(const PlanarOptions& options) : options_(options) {}

  /// Starts at rest, with nothing known but roughly a position; counts go on.
  /// @param position  ENU, m; taken as known to 100 m
  void start(Time time, const Vector3d& position);
  [[nodiscard]] bool started() const { return started_; }

  /// Moves on with the mean of the odometry over the interval. Times that do not lie ahead are passed over.
  /// After a minute without odometry the filter has to be started again.
  /// @param mean  its time is that of the last sample: the longer ago, the less it says
  /// (`PlanarOptions::gap`)
  void propagate(Time to, const PlanarOdometry& mean);

  /// Each satellite's range for itself. Needs `started()`.
  /// @return what each satellite's range counted
  std::vector<RangeShare> update(const RawEpoch& epoch);
  /// A position instead; the share that it counted.
  double update(const GnssFix& fix);

  [[nodiscard]] PlanarEstimate estimate() const;
  [[nodiscard]] const PlanarMatrix& covariance() const { return P_; }
  [[nodiscard]] const PlanarTally& tally() const { return tally_; }
  /// The values in the order of the errors.
  [[nodiscard]] PlanarVector state() const;

 private:
  using Cross = Eigen::Matrix<double, kPlanarStates, kRawVariables>;

  [[nodiscard]] RawVariables raw_variables() const;
  [[nodiscard]] Eigen::Vector2d direction(double angle) const;
  void turn_noise(double variance);
  void start_receiver(const RawEpoch& epoch);
  void follow_clock_jump(const RawEpoch& epoch);
  /// Opens position and clock for the satellites, if most of them have contradicted for long enough.
  void believe_again(const RawEpoch& epoch);
  [[nodiscard]] double share_of(double u) const;  ///< of a residual in sigmas
  /// By how much variances are enlarged because errors last.
  double lasting(Time time);
  void apply(const PlanarVector& error);
  void know_scale();

  PlanarOptions options_;
  bool started_ = false;
  Time time_;
  Vector3d position_ = Vector3d::Zero();
  double turned_ = 0;                                  ///< since the start, as measured, rad
  Eigen::Vector2d heading_ = Eigen::Vector2d::Zero();  ///< scale · (cos, sin) of the yaw at the start
  double bias_ = 0;
  double speed_ = 0;  ///< as measured
  ReceiverState receiver_;
  bool clock_known_ = false;
  std::array<bool, 3> system_known_{};
  bool scale_known_ = false;
  std::optional<Time> last_epoch_;
  std::optional<Time> gap_since_;  ///< of the last gap
  Time agreed_;                    ///< last time that most of the ranges counted
  PlanarMatrix P_ = PlanarMatrix::Zero();
  PlanarTally tally_;
};

}  // namespace pade::navigation
