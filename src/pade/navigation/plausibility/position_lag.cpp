#include "pade/navigation/plausibility/position_lag.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pade::navigation {
namespace {

using Eigen::Vector3d;

constexpr double kLongestStep = 2;  // s between velocities that are integrated
constexpr double kShortestWay = 1;  // s between the fixes of a way
constexpr double kLongestWay = 5;
constexpr double kFarthest = 3;     // s
constexpr double kShortest = 0.05;  // s
constexpr double kSigmas = 5;
constexpr std::size_t kFewest = 20;  // ways

/// The way that the velocities fly, as a function of time.
class Flown {
 public:
  explicit Flown(const GnssLog& gnss) {
    if (gnss.velocities.empty()) return;
    zero_ = gnss.velocities.front().time;
    Vector3d sum = Vector3d::Zero();
    const GnssVelocity* last = nullptr;
    for (const GnssVelocity& velocity : gnss.velocities) {
      const double t = seconds_between(zero_, velocity.time);
      if (!times_.empty() && t <= times_.back()) continue;
      if (!times_.empty() && t - times_.back() > kLongestStep) ++span_;
      spans_.push_back(span_);
      if (last != nullptr) sum += 0.5 * (t - times_.back()) * (last->velocity + velocity.velocity);
      times_.push_back(t);
      ways_.push_back(sum);
      velocities_.push_back(velocity.velocity);
      last = &velocity;
    }
  }

  [[nodiscard]] double seconds(Time time) const { return seconds_between(zero_, time); }

  /// NaN outside the velocities and in their gaps.
  [[nodiscard]] Vector3d until(double t) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), t);
    if (after == times_.begin() || after == times_.end()) return Vector3d::Constant(std::nan(""));
    const auto i = static_cast<std::size_t>(after - times_.begin()) - 1;
    const double step = times_[i + 1] - times_[i];
    if (step > kLongestStep) return Vector3d::Constant(std::nan(""));
    const double s = t - times_[i];
    return ways_[i] + s * velocities_[i] + 0.5 * s * s / step * (velocities_[i + 1] - velocities_[i]);
  }

  /// Number of the stretch without a gap that holds t, where until(t) is a number.
  [[nodiscard]] int span(double t) const {
    const auto after = std::upper_bound(times_.begin(), times_.end(), t);
    return spans_[static_cast<std::size_t>(after - times_.begin()) - 1];
  }

 private:
  int span_ = 0;
  std::vector<int> spans_;
  Time zero_;
  std::vector<double> times_;
  std::vector<Vector3d> ways_;
  std::vector<Vector3d> velocities_;
};

struct Way {
  double from = 0, to = 0;
  Vector3d moved = Vector3d::Zero();
};

/// Between fixes at least kShortestWay apart, away from the ends of the velocities and their gaps.
std::vector<Way> ways_of(const GnssLog& gnss, const Flown& flown) {
  std::vector<Way> ways;
  const GnssFix* last = nullptr;
  for (const GnssFix& fix : gnss.fixes) {
    const double gap = last == nullptr ? 0 : seconds_between(last->time, fix.time);
    if (last != nullptr && gap < kShortestWay) continue;
    if (last != nullptr && gap < kLongestWay) {
      const Way way{flown.seconds(last->time), flown.seconds(fix.time), fix.position - last->position};
      const bool inside =
          flown.until(way.from - kFarthest).allFinite() && flown.until(way.to + kFarthest).allFinite();
      if (inside && way.moved.allFinite()) ways.push_back(way);
    }
    last = &fix;
  }
  return ways;
}

/// Sum of the squared differences with the positions `lag` late, over the ways where every lag has
/// velocities.
double misfit(const std::vector<Way>& ways, const Flown& flown, double lag) {
  double sum = 0;
  for (const Way& way : ways) {
    const Vector3d difference = flown.until(way.to - lag) - flown.until(way.from - lag) - way.moved;
    // One wrong fix is not to outweigh a flight.
    constexpr double kLargest = 100;  // m²
    if (difference.allFinite()) sum += std::min(difference.squaredNorm(), kLargest);
  }
  return sum;
}

}  // namespace

std::optional<PositionLag> position_lag(const GnssLog& gnss) {
  const Flown flown(gnss);
  const std::vector<Way> ways = ways_of(gnss, flown);
  if (ways.size() < kFewest) return std::nullopt;
  const double none = misfit(ways, flown, 0);
  double best = 0;
  double least = none;
  const auto look = [&](double from, double to, double step) {
    for (double lag = from; lag <= to; lag += step) {
      if (const double now = misfit(ways, flown, lag); now < least) {
        least = now;
        best = lag;
      }
    }
  };
  look(-kFarthest, kFarthest, 0.1);
  look(best - 0.1, best + 0.1, 0.01);
  if (std::abs(best) < kShortest || std::abs(best) > kFarthest - 0.1) return std::nullopt;
  const double variance = least / (3 * static_cast<double>(ways.size()));
  if (none - least < kSigmas * kSigmas * variance) return std::nullopt;
  const auto count = static_cast<double>(ways.size());
  return PositionLag{best, std::abs(best) * std::sqrt(variance / (none - least)), std::sqrt(none / count),
                     std::sqrt(least / count)};
}

std::optional<PositionDrift> position_drift(const GnssLog& gnss, double lag) {
  constexpr double kLeast = 10;  // m
  const Flown flown(gnss);
  std::optional<PositionDrift> found;
  double most = 1;  // of the limits
  int span = -1;
  double since = 0;
  Vector3d start = Vector3d::Zero();
  for (const GnssFix& fix : gnss.fixes) {
    const double t = flown.seconds(fix.time) - lag;
    const Vector3d beyond = flown.until(t) - fix.position;
    if (!beyond.allFinite()) continue;
    if (flown.span(t) != span) {
      span = flown.span(t);
      since = t;
      start = beyond;
    }
    const Vector3d parted = beyond - start;
    for (int axis = 0; axis < 3; ++axis) {
      const double sigma = std::sqrt(fix.covariance(axis, axis));
      const double limit = kLeast + (std::isfinite(sigma) ? kSigmas * sigma : 0);
      if (!(std::abs(parted[axis]) > most * limit)) continue;
      most = std::abs(parted[axis]) / limit;
      found = PositionDrift{axis, parted[axis], t - since};
    }
  }
  return found;
}

}  // namespace pade::navigation
