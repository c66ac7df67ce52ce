#include "pade/navigation/navigation_run.hpp"

#include <algorithm>
#include <span>

#include "pade/core/compute/median.hpp"
#include "pade/navigation/replay.hpp"

namespace pade {
namespace {

using navigation::Answer;

/// @param longest_gap  s
std::vector<Time> regular_times(const NavigationLog& log, double rate, double longest_gap) {
  std::vector<Time> times;
  if (log.imu.empty() || !(rate > 0)) return times;
  std::vector<Time> stamps;
  for (const ImuSample& sample : log.imu) stamps.push_back(sample.time);
  std::sort(stamps.begin(), stamps.end());
  const auto step = std::max<std::int64_t>(1, Time::from_seconds(1 / rate).nanoseconds);
  Time t = stamps.front();
  Time last = t;
  for (const Time stamp : stamps) {
    // In a gap that long, or between the two times of a clock that was set, there is nothing to say.
    if (seconds_between(last, stamp) > longest_gap && t < stamp)
      t.nanoseconds += (stamp.nanoseconds - t.nanoseconds + step - 1) / step * step;
    for (; t <= stamp; t.nanoseconds += step) times.push_back(t);
    last = stamp;
  }
  return times;
}

/// The buffers hold what an IMU of this rate delivers.
double rate_of(const std::vector<ImuSample>& samples) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double step = seconds_between(samples[i - 1].time, samples[i].time);
    if (step > 0) steps.push_back(step);
  }
  constexpr double kReserve = 1.2;
  constexpr double kFastest = 1e5;  // Hz
  return steps.empty() ? 0 : std::min(kFastest, kReserve / median(steps));
}

/// The longest run of motions each of which begins where the one before ends; the first of equal ones.
std::span<const FrameMotion> longest_chain(std::span<const FrameMotion> motions) {
  std::span<const FrameMotion> longest;
  for (std::size_t begin = 0; begin < motions.size();) {
    std::size_t end = begin + 1;
    while (end < motions.size() && motions[end].t1 == motions[end - 1].t2) ++end;
    if (end - begin > longest.size()) longest = motions.subspan(begin, end - begin);
    begin = end;
  }
  return longest;
}

/// What the frames of a run say: how many, how fast.
void count_frames(NavigationRun& run) {
  std::vector<double> speeds;
  for (const NavigationFrame& frame : run.frames) {
    speeds.push_back(frame.pose.velocity.norm());
    run.health.frames_lost += frame.status == navigation::NavigationStatus::lost ? 1 : 0;
  }
  run.health.frames = speeds.size();
  if (speeds.empty()) return;
  std::sort(speeds.begin(), speeds.end());
  run.health.speed_median = speeds[speeds.size() / 2];
  run.health.speed_largest = speeds.back();
}

}  // namespace

NavigationRun run_navigation(const NavigationLog& log, const NavigationRunOptions& options) {
  NavigationRun run;
  navigation::NavigatorOptions fitting = options.navigator;
  fitting.imu_rate = std::max(fitting.imu_rate, rate_of(log.imu));
  navigation::Navigator navigator(fitting);
  navigator.on_retired([&run](const navigation::Measurement& m) { run.measurements.push_back(m); });
  std::vector<Time> frames = options.frames.empty()
                                 ? regular_times(log, options.rate, options.navigator.longest_gap)
                                 : options.frames;
  std::sort(frames.begin(), frames.end());
  navigation::ReplayOptions replay;
  if (options.heading) replay.headings.push_back(*options.heading);
  replay.raw = options.raw;
  if (options.on_road) replay.road_rate = 5;

  const auto offset = Time::from_seconds(options.navigator.camera_time_offset).nanoseconds;
  std::size_t next = 0;
  navigation::replay(log, navigator, replay, [&](Time now) {
    for (; next < frames.size() && frames[next].nanoseconds + offset <= now.nanoseconds; ++next) {
      const Time t = frames[next];
      const auto pose = navigator.absolute_pose(t);
      navigation::RelativePose motion;
      if (pose.answer != Answer::valid) {
        ++run.health.frames_without_answer;
      } else {
        if (next > 0 && !run.frames.empty() && run.frames.back().time == frames[next - 1]) {
          motion = navigator.relative_pose(frames[next - 1], t, options.T_body_camera);
          if (motion.answer == Answer::valid) run.motions.push_back({frames[next - 1], t, motion});
        }
        run.frames.push_back({t, pose, navigator.health().status});
      }
      // Behind the answer: what a frame is told has nothing of its own image.
      if (!options.camera || next == 0) continue;
      if (const auto seen = options.camera(frames[next - 1], t, motion)) navigator.add(*seen);
    }
  });
  run.health.frames_without_answer += frames.size() - next;
  run.health.filter = navigator.health();
  run.raw = navigator.raw_tally();
  run.camera = navigator.camera_tally();
  run.camera_mounting = navigator.camera_mounting();
  run.health.sensors = navigation::summarise(run.measurements);
  count_frames(run);
  return run;
}

CameraTrajectory camera_trajectory(const NavigationRun& run, const Pose& T_body_camera) {
  CameraTrajectory trajectory;
  trajectory.health = run.health;
  const std::span<const FrameMotion> chain = longest_chain(run.motions);
  if (!chain.empty()) {
    const Time start = chain.front().t1;
    const auto first = std::find_if(run.frames.begin(), run.frames.end(),
                                    [&](const NavigationFrame& frame) { return frame.time == start; });
    trajectory.times = {start};
    trajectory.poses = {camera_pose(first->pose.T_world_body, T_body_camera)};
    trajectory.frames_left = run.frames.size() - chain.size() - 1;
  }
  for (const FrameMotion& m : chain) {
    const Pose step{Eigen::Quaterniond(m.pose.motion.R_reference_other), m.pose.motion.t_reference_other};
    trajectory.times.push_back(m.t2);
    trajectory.poses.push_back(trajectory.poses.back() * step);
    trajectory.motions.push_back(m.pose.motion);
    trajectory.scale_valid.push_back(m.pose.scale_valid);
    trajectory.direction_valid.push_back(m.pose.direction_valid);
  }
  return trajectory;
}

}  // namespace pade
