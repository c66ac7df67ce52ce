#include "pade/paper/navigation_protocol.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pade/core/random.hpp"

namespace pade {
namespace {

Time after(Time time, double seconds) {
  return Time{time.nanoseconds + Time::from_seconds(seconds).nanoseconds};
}

double yaw_of(const Pose& T_world_body) {
  const Eigen::Vector3d x = T_world_body.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

/// Rotation about the world's vertical that takes the estimate to the truth.
double yaw_error(const Pose& estimate, const Pose& truth) {
  return rotation_log(Eigen::Quaterniond(estimate.rotation * truth.rotation.conjugate())).z();
}

struct SquareSums {
  double velocity = 0;
  double tilt = 0;
  double position = 0;
  double count = 0;

  void add(const navigation::AbsolutePose& estimate, const TrueState& truth) {
    const Eigen::Vector3d up = truth.T_world_body.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d estimated = estimate.T_world_body.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    velocity += (estimate.velocity - truth.velocity).squaredNorm();
    tilt += up.cross(estimated).squaredNorm();
    position += (estimate.T_world_body.translation - truth.T_world_body.translation).squaredNorm();
    count += 1;
  }
};

/// The first stamp of the truth at or after each k * step: pairs lie on the truth's own grid.
std::vector<Time> grid(const std::vector<TrueState>& truth, const NavigationProtocol& protocol) {
  std::vector<Time> times;
  const Time from = Time::from_seconds(protocol.score_from - protocol.long_pair);
  for (auto it = truth.begin(); it != truth.end();) {
    if (it->time < from) {
      ++it;
      continue;
    }
    if (it->time > Time::from_seconds(protocol.score_to)) break;
    times.push_back(it->time);
    const Time next = after(it->time, protocol.step);
    it = std::lower_bound(it, truth.end(), next, [](const TrueState& s, Time t) { return s.time < t; });
  }
  return times;
}

}  // namespace

NavigationFigures run_protocol(const NavigationLog& log, const navigation::NavigatorOptions& options,
                               const NavigationProtocol& protocol) {
  NavigationFigures figures;
  navigation::Navigator navigator(options);
  navigation::ReplayOptions replay = protocol.replay;
  replay.from = Time::from_seconds(protocol.start);
  const double heading_sigma = protocol.heading_sigma * std::numbers::pi / 180;
  const auto start_truth = evaluation::truth_at(log.truth, after(replay.from, 1));
  if (protocol.heading_given && start_truth) {
    Random random(protocol.seed);
    replay.headings.push_back({start_truth->time,
                               yaw_of(start_truth->T_world_body) + heading_sigma * random.normal(),
                               heading_sigma});
  }

  const std::vector<Time> times = grid(log.truth, protocol);
  std::size_t next = 0;
  SquareSums sums;
  bool aligned = false;
  const auto compare = [&](Time t1, Time t2, std::vector<evaluation::MotionError>& errors) {
    const auto answer = navigator.relative_pose(t1, t2, Pose{});
    if (answer.answer != navigation::Answer::valid) return;
    figures.finite =
        figures.finite && answer.motion.t_reference_other.allFinite() && answer.motion.covariance.allFinite();
    const auto error =
        evaluation::score({t1, t2, answer.motion, answer.scale_valid, answer.direction_valid}, log.truth);
    if (error) errors.push_back(*error);
  };
  navigation::replay(log, navigator, replay, [&](Time now) {
    if (!aligned) {
      const auto status = navigator.health().status;
      aligned = status == navigation::NavigationStatus::navigating;
      if (aligned) {
        figures.aligned = now;
        const auto truth = evaluation::truth_at(log.truth, now);
        if (truth)
          figures.yaw_error_aligned =
              yaw_error(navigator.absolute_pose(now).T_world_body, truth->T_world_body);
      }
    }
    for (; next < times.size() && after(times[next], protocol.answer_delay) <= now; ++next) {
      const Time t2 = times[next];
      if (t2 < Time::from_seconds(protocol.score_from)) continue;
      compare(after(t2, -protocol.short_pair), t2, figures.short_errors);
      compare(after(t2, -protocol.long_pair), t2, figures.long_errors);
      const auto truth = evaluation::truth_at(log.truth, t2);
      const auto estimate = navigator.absolute_pose(t2);
      if (!truth || estimate.answer != navigation::Answer::valid) continue;
      sums.add(estimate, *truth);
      figures.yaw_error_end = yaw_error(estimate.T_world_body, truth->T_world_body);
    }
  });
  figures.health = navigator.health();
  figures.short_pairs = evaluation::summarise(figures.short_errors);
  figures.long_pairs = evaluation::summarise(figures.long_errors);
  figures.velocity_rms = std::sqrt(sums.velocity / sums.count);
  figures.tilt_rms = std::sqrt(sums.tilt / sums.count);
  figures.position_rms = std::sqrt(sums.position / sums.count);
  return figures;
}

}  // namespace pade
