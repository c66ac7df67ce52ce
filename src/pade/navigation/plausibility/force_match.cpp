#include "pade/navigation/plausibility/force_match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/SVD>

#include "pade/core/pose.hpp"

namespace pade::navigation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGravity = 9.80665;  // m/s²
constexpr double kLongest = 120;      // s of the log that are looked at
constexpr double kWindow = 5;         // s: drift of a gyroscope of 0.05 rad/s turns by a few degrees
constexpr double kInterval = 0.4;     // s between the velocities of an interval, at least
constexpr double kLongestInterval = 1.6;
constexpr std::size_t kLeastIntervals = 3;  // per window
constexpr double kGap = 0.1;                // s without IMU samples

/// What the best rotation leaves of sum |a - R b|² (Markley, "Attitude determination using vector
/// observations and the singular value decomposition", 1988).
double residual_of(const Matrix3d& correlation, double squares) {
  const Eigen::JacobiSVD<Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() > 0 ? 1 : -1;
  const Vector3d s = svd.singularValues();
  return std::max(0.0, squares - 2 * (s[0] + s[1] + sign * s[2]));
}

}  // namespace

Reading with_bias(const NavigationLog& log, Reading reading) {
  constexpr double kStep = 0.04;  // rad/s
  constexpr double kLargestBias = 0.2;
  const auto squared = [&](const Reading& r) {
    const double misfit = ForceMatch(log, r).misfit();
    return misfit * misfit;
  };
  double here = squared(reading);
  for (int sweep = 0; sweep < 2 && std::isfinite(here); ++sweep) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      // The minimum of the parabola through three points.
      Reading low = reading, high = reading, best = reading;
      low.gyroscope_bias[axis] -= kStep;
      high.gyroscope_bias[axis] += kStep;
      const double below = squared(low);
      const double above = squared(high);
      const double curvature = below - 2 * here + above;
      if (!(curvature > 0)) continue;
      const double bias = reading.gyroscope_bias[axis] + 0.5 * kStep * (below - above) / curvature;
      best.gyroscope_bias[axis] = std::clamp(bias, -kLargestBias, kLargestBias);
      if (const double there = squared(best); there < here) {
        here = there;
        reading = best;
      }
    }
  }
  return reading;
}

ForceMatch::ForceMatch(const NavigationLog& log, const Reading& reading) {
  if (log.imu.empty()) return;
  zero_ = log.imu.front().time;
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  Vector3d integral = Vector3d::Zero();
  const double force = reading.force_turned ? -1 : 1;
  const Vector3d signs = reading.gyroscope_turned ? Vector3d(1, -1, -1) : Vector3d(1, 1, 1);
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    const double t = seconds_between(zero_, log.imu[i].time);
    if (!times_.empty() && t <= times_.back()) continue;
    if (t > kLongest) break;
    if (!times_.empty()) {
      const double step = t - times_.back();
      const Vector3d rate =
          reading.gyroscope_scale * log.imu[i].angular_rate.cwiseProduct(signs) - reading.gyroscope_bias;
      turned = (turned * rotation_exp(Vector3d(rate * step))).normalized();
      integral += force * step * (turned * log.imu[i].specific_force);
    }
    times_.push_back(t);
    integral_.push_back(integral);
  }
  const GnssVelocity* last = nullptr;
  double window_from = -std::numeric_limits<double>::infinity();
  for (const GnssVelocity& velocity : log.gnss.velocities) {
    const double t = seconds_between(zero_, velocity.time);
    if (t > kLongest) break;
    const double step = last == nullptr ? 0 : seconds_between(last->time, velocity.time);
    if (last != nullptr && step < kInterval) continue;
    if (last != nullptr && step <= kLongestInterval) {
      Vector3d change = (velocity.velocity - last->velocity) / step;
      if (reading.velocity_of_ned) change = Vector3d(change.y(), change.x(), -change.z());
      if (t - window_from > kWindow) {
        windows_.emplace_back();
        window_from = t;
      }
      windows_.back().push_back({t - step, t, change + Vector3d(0, 0, kGravity)});
    }
    last = &velocity;
  }
}

Vector3d ForceMatch::integrated_to(double t) const {
  const auto after = std::lower_bound(times_.begin(), times_.end(), t);
  const Vector3d none = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  if (after == times_.begin() || after == times_.end()) return none;
  const auto i = static_cast<std::size_t>(after - times_.begin());
  const double step = times_[i] - times_[i - 1];
  if (step > kGap) return none;
  const double share = (t - times_[i - 1]) / step;
  return integral_[i - 1] + share * (integral_[i] - integral_[i - 1]);
}

double ForceMatch::misfit(double lag) const {
  double sum = 0;
  std::size_t count = 0;
  std::size_t used = 0;
  for (const auto& window : windows_) {
    Matrix3d correlation = Matrix3d::Zero();
    double squares = 0;
    std::size_t intervals = 0;
    for (const Interval& interval : window) {
      const Vector3d mean = (integrated_to(interval.to - lag) - integrated_to(interval.from - lag)) /
                            (interval.to - interval.from);
      if (!mean.allFinite()) continue;
      correlation += interval.force * mean.transpose();
      squares += interval.force.squaredNorm() + mean.squaredNorm();
      ++intervals;
    }
    if (intervals < kLeastIntervals) continue;
    sum += residual_of(correlation, squares);
    count += intervals;
    ++used;
  }
  if (used < 2 || 2 * used < windows_.size()) return std::numeric_limits<double>::infinity();
  return std::sqrt(sum / static_cast<double>(count));
}

std::optional<ForceMatch::Lag> ForceMatch::lag() const {
  const double as_stamped = misfit();
  if (!std::isfinite(as_stamped)) return std::nullopt;
  Lag best{0, as_stamped};
  const auto look = [&](double seconds) {
    if (const double now = misfit(seconds); now < best.misfit) best = {seconds, now};
  };
  constexpr double kFarthest = 40;  // s: leap seconds to TAI and a little
  for (double t = -kFarthest; t <= kFarthest; t += 0.1) look(t);
  const double coarse = best.seconds;
  for (double t = coarse - 0.1; t <= coarse + 0.1; t += 0.01) look(t);
  // Of many far candidates one fits better by chance.
  const double clearly = std::abs(best.seconds) > 1 ? 0.6 : 0.8;
  constexpr double kShortest = 0.05;  // s
  if (best.misfit > clearly * as_stamped || std::abs(best.seconds) < kShortest) return std::nullopt;
  return best;
}

}  // namespace pade::navigation
