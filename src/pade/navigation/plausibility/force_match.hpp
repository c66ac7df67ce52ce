// How well inertial data and GNSS velocities belong together, without a filter: Wahba's problem over short
// windows.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/sensors/navigation_log.hpp"

namespace pade::navigation {

/// Another reading of the same data.
struct Reading {
  double gyroscope_scale = 1;     ///< times the angular rate
  bool gyroscope_turned = false;  ///< y and z of the angular rate have the other sign
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();  ///< rad/s, after the scale and in its axes
  bool velocity_of_ned = false;                              ///< the velocities are north, east, down
  bool force_turned = false;                                 ///< all specific forces have the other sign
};

/// `reading` with the gyroscope bias that fits best, within 0.2 rad/s: over windows of 5 s a bias of 0.08
/// rad/s, as small sensors have it, turns by more than a wrong reading of a gentle flight.
Reading with_bias(const NavigationLog& log, Reading reading);

/// The mean specific force of an interval between two GNSS velocities, turned by the integrated gyroscopes to
/// the start, and the change of the velocity over the interval plus gravity, are the same vector but for one
/// rotation.
class ForceMatch {
 public:
  /// Looks at the first minutes of the log.
  ForceMatch(const NavigationLog& log, const Reading& reading);

  /// Root mean square of what is left over, m/s², with the velocities `lag` seconds late. Infinite if the
  /// log holds too little: fewer than two windows with velocities and IMU.
  [[nodiscard]] double misfit(double lag = 0) const;

  /// The lag that fits clearly better than none: positive = the velocities are late.
  struct Lag {
    double seconds = 0;
    double misfit = 0;  ///< m/s²
  };
  [[nodiscard]] std::optional<Lag> lag() const;

 private:
  struct Interval {
    double from = 0, to = 0;  ///< s after zero_
    Eigen::Vector3d force;    ///< change of velocity per second plus gravity, m/s²
  };
  [[nodiscard]] Eigen::Vector3d integrated_to(double t) const;

  Time zero_;
  std::vector<double> times_;              ///< of the samples, s after zero_
  std::vector<Eigen::Vector3d> integral_;  ///< of the turned specific force, m/s
  std::vector<std::vector<Interval>> windows_;
};

}  // namespace pade::navigation
