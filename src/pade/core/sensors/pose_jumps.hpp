// Whether a pose belongs to those before it or to another world, as every source of poses decides it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>

#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"

namespace pade {

/// Nothing is put between poses that are farther apart, s.
inline constexpr double kFarthestPosesApart = 0.25;
/// Poses before and after a longer silence do not belong together: estimates are set anew in it, s.
inline constexpr double kLongestPoseGap = 2;

/// How far a quantity may be off what is said of its motion.
struct MotionSlack {
  double error = 0;         ///< at any time: m, rad
  double growth = 0;        ///< with the time from sample to sample: m/s, rad/s
  double acceleration = 0;  ///< that nobody saw between samples more than kFarthestPosesApart apart, per s²
};

/// How far that is after `dt` seconds. Below 0, so that nothing is explained, after more than
/// kLongestPoseGap.
inline double explained(double dt, const MotionSlack& slack) {
  const double unseen = dt > kFarthestPosesApart ? slack.acceleration * dt * dt / 2 : 0;
  return dt > kLongestPoseGap ? -1 : slack.error + slack.growth * dt + unseen;
}

/// A pose that does not follow from those before.
struct PoseJump {
  /// What of it does not follow: where it is, where it looks, or that it comes after too long a time.
  enum class Kind : std::uint8_t { place, turn, gap };
  Kind kind = Kind::place;  ///< which of these
  double size = 0;          ///< off where the motion leads to: m, rad; of a gap its length, s
};

/// What the next pose is off where the poses before lead to, with the velocity and rate of their last 0.05 to
/// 0.5 s. A vehicle explains 0.3 m and what 30 m/s² make of the time, 9° and what 60 rad/s² make of it about
/// any axis and 20 rad/s² about the vertical, in which headings are set anew; over a gap of more than
/// kFarthestPosesApart what 3 m/s², 3 rad/s² and an error of 0.5 m/s, 0.15 rad/s add to that; nothing over
/// more than kLongestPoseGap. Where the poses before are too few for a velocity, 30 m/s and 10 rad/s.
/// @param samples  each with `time` and `pose` (T_world_x, z of the world up), in their order
/// @param time     of the next pose, not before that of the last sample
/// @param next     that pose, T_world_x
/// @return empty: it follows
template <class Samples>
std::optional<PoseJump> jump_to(const Samples& samples, Time time, const Pose& next) {
  using Kind = PoseJump::Kind;
  constexpr double kLeastSpan = 0.05, kLongestSpan = 2 * kFarthestPosesApart;  // s, for a velocity
  constexpr double kFirstSpeed = 30, kFirstRate = 10;                          // m/s, rad/s
  constexpr double kAcceleration = 30;                                         // m/s²
  constexpr double kTurning = 60, kHeading = 20;                               // rad/s²
  constexpr MotionSlack kWay{0.3, 0.5, 3}, kAngle{0.15, 0.15, 3};
  if (std::begin(samples) == std::end(samples)) return std::nullopt;
  const auto last = std::rbegin(samples);
  const double dt = seconds_between(last->time, time);
  if (!(dt > 0)) return std::nullopt;
  if (dt > kLongestPoseGap) return PoseJump{Kind::gap, dt};
  const double seen = std::min(dt, kFarthestPosesApart);
  const auto slack = [&](MotionSlack s) {
    if (dt <= kFarthestPosesApart) s.growth = 0;
    return explained(dt, s);
  };
  Pose expected = last->pose;
  double way = slack(kWay) + kFirstSpeed * seen;
  double turn = slack(kAngle) + kFirstRate * seen, heading = turn;
  const auto before = std::find_if(last, std::rend(samples), [&](const auto& sample) {
    return seconds_between(sample.time, last->time) >= kLeastSpan;
  });
  const double span = before == std::rend(samples) ? 0 : seconds_between(before->time, last->time);
  if (span > 0 && span <= kLongestSpan) {
    const double share = dt / span;
    const Eigen::Vector3d turned = rotation_log(last->pose.rotation * before->pose.rotation.conjugate());
    expected.translation += share * (last->pose.translation - before->pose.translation);
    expected.rotation = rotation_exp(share * turned) * last->pose.rotation;
    const double squared = seen * (seen + span) / 2;
    way = slack(kWay) + kAcceleration * squared;
    turn = slack(kAngle) + kTurning * squared;
    heading = slack(kAngle) + kHeading * squared;
  }
  const double off = (next.translation - expected.translation).norm();
  if (!(off <= way)) return PoseJump{Kind::place, off};
  const Eigen::Vector3d turned = rotation_log(next.rotation * expected.rotation.conjugate());
  if (!(turned.norm() <= turn)) return PoseJump{Kind::turn, turned.norm()};
  if (!(std::abs(turned.z()) <= heading)) return PoseJump{Kind::turn, std::abs(turned.z())};
  return std::nullopt;
}

}  // namespace pade
