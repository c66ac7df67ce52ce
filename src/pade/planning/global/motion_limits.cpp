#include "pade/planning/global/motion_limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pade/core/option_check.hpp"

namespace pade::planning {
namespace {

using Eigen::Vector3d;

constexpr double kStraight = 1e-6;         // sine of half of an angle that is none
constexpr double kDeviation = 0.001;       // of straight lines from the motion, m
constexpr double kLongestInterval = 0.05;  // s
constexpr double kShortestPiece = 1e-9;    // that is not left out, s

/// Constant acceleration.
struct Piece {
  double duration = 0;
  Vector3d position, velocity, acceleration;
};

/// Speed and the part of each leg that is taken by a corner's parabola.
class Corners {
 public:
  Corners(std::span<const Vector3d> corners, std::span<const double> rounding, const MotionLimits& limits)
      : corners_(corners), limits_(limits) {
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      const Vector3d leg = corners[i + 1] - corners[i];
      lengths_.push_back(leg.norm());
      directions_.push_back(leg / leg.norm());
    }
    bends_.assign(corners.size(), 0);
    speeds_.assign(corners.size(), 0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      const double cosine = directions_[i - 1].dot(directions_[i]);
      bends_[i] = std::sqrt(std::max((1 - cosine) / 2, 0.0));
      const double most = rounding[i] * 0.5 * std::min(lengths_[i - 1], lengths_[i]);
      speeds_[i] = bends_[i] < kStraight
                       ? limits.speed
                       : std::min(limits.speed, std::sqrt(limits.acceleration * most / bends_[i]));
    }
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) limit(i, i + 1, i);
    for (std::size_t i = corners.size() - 1; i > 0; --i) limit(i, i - 1, i - 1);
  }

  [[nodiscard]] std::vector<Piece> pieces() const {
    std::vector<Piece> pieces;
    for (std::size_t leg = 0; leg < lengths_.size(); ++leg) {
      add_leg(leg, pieces);
      if (leg + 1 < lengths_.size()) add_bend(leg + 1, pieces);
    }
    return pieces;
  }

 private:
  /// Of each leg beside a corner.
  [[nodiscard]] double cut(std::size_t i) const {
    return bends_[i] < kStraight ? 0 : speeds_[i] * speeds_[i] * bends_[i] / limits_.acceleration;
  }
  [[nodiscard]] double straight(std::size_t leg) const {
    return std::max(lengths_[leg] - cut(leg) - cut(leg + 1), 0.0);
  }
  /// No faster at `to` than can be reached from, or braked to, the speed at `from`.
  void limit(std::size_t from, std::size_t to, std::size_t leg) {
    const double reachable =
        std::sqrt(speeds_[from] * speeds_[from] + 2 * limits_.acceleration * straight(leg));
    speeds_[to] = std::min(speeds_[to], reachable);
  }

  void add_leg(std::size_t leg, std::vector<Piece>& pieces) const {
    const double a = limits_.acceleration;
    const double v0 = speeds_[leg];
    const double v1 = speeds_[leg + 1];
    const double length = straight(leg);
    const double peak =
        std::max({std::min(limits_.speed, std::sqrt(a * length + 0.5 * (v0 * v0 + v1 * v1))), v0, v1});
    const double faster = (peak * peak - v0 * v0) / (2 * a);
    const double slower = (peak * peak - v1 * v1) / (2 * a);
    const Vector3d& u = directions_[leg];
    Vector3d at = corners_[leg] + cut(leg) * u;
    const auto add = [&](double duration, double speed, double rate) {
      if (!(duration > kShortestPiece)) return;
      pieces.push_back({duration, at, speed * u, rate * u});
      at += (speed * duration + 0.5 * rate * duration * duration) * u;
    };
    add((peak - v0) / a, v0, a);
    add(peak > 0 ? (length - faster - slower) / peak : 0, peak, 0);
    add((peak - v1) / a, peak, -a);
  }

  void add_bend(std::size_t i, std::vector<Piece>& pieces) const {
    const double leg = cut(i);
    if (!(leg > 0 && speeds_[i] > 0)) return;
    const double duration = 2 * leg / speeds_[i];
    if (!(duration > kShortestPiece)) return;
    const Vector3d& before = directions_[i - 1];
    const Vector3d& after = directions_[i];
    pieces.push_back({duration, corners_[i] - leg * before, speeds_[i] * before,
                      speeds_[i] / duration * (after - before)});
  }

  std::span<const Vector3d> corners_;
  MotionLimits limits_;
  std::vector<double> lengths_;
  std::vector<Vector3d> directions_;
  std::vector<double> bends_;   // sine of half of the angle between the legs
  std::vector<double> speeds_;  // at the corner
};

}  // namespace

Status check(const MotionLimits& limits) {
  return check_ranges(std::array{OptionRange{"speed", limits.speed, 0.01, 100},
                                 OptionRange{"acceleration", limits.acceleration, 0.01, 100}});
}

std::vector<MotionPoint> motion_along(std::span<const Vector3d> corners, std::span<const double> rounding,
                                      const MotionLimits& limits) {
  std::vector<MotionPoint> points;
  if (corners.empty()) return points;
  if (corners.size() == 1) return {{0, corners[0], Vector3d::Zero()}};
  const double step = std::min(kLongestInterval, std::sqrt(8 * kDeviation / limits.acceleration));
  double begin = 0;
  for (const Piece& piece : Corners(corners, rounding, limits).pieces()) {
    const auto steps = static_cast<int>(std::ceil(piece.duration / step));
    for (int k = 0; k < steps; ++k) {
      const double t = piece.duration * k / steps;
      points.push_back({begin + t, piece.position + t * piece.velocity + 0.5 * t * t * piece.acceleration,
                        piece.velocity + t * piece.acceleration});
    }
    begin += piece.duration;
  }
  points.push_back({begin, corners.back(), Vector3d::Zero()});
  return points;
}

}  // namespace pade::planning
