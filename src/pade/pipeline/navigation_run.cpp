#include "pade/pipeline/navigation_run.hpp"

#include <algorithm>
#include <iterator>
#include <span>

#include <fmt/format.h>

#include "pade/navigation/replay.hpp"

namespace pade {
namespace {

using navigation::Answer;

std::vector<Time> regular_times(const NavigationLog& log, double rate) {
  std::vector<Time> times;
  if (log.imu.empty() || !(rate > 0)) return times;
  const auto [first, last] = std::minmax_element(
      log.imu.begin(), log.imu.end(), [](const ImuSample& a, const ImuSample& b) { return a.time < b.time; });
  const auto step = Time::from_seconds(1 / rate).nanoseconds;
  for (Time t = first->time; t <= last->time; t.nanoseconds += step) times.push_back(t);
  return times;
}

std::optional<evaluation::MotionSummary> score_motions(const NavigationLog& log,
                                                       const NavigationRunOptions& options,
                                                       const std::vector<FrameMotion>& motions) {
  if (log.truth.empty()) return std::nullopt;
  std::vector<evaluation::MotionError> errors;
  for (const FrameMotion& m : motions) {
    // The truth is of the body: score the motion that the body made.
    RelativeMotion body = m.pose.motion;
    const Pose camera{Eigen::Quaterniond(body.R_reference_other), body.t_reference_other};
    const Pose moved = options.T_body_camera * camera * options.T_body_camera.inverse();
    const bool same = options.T_body_camera.translation.isZero(0) &&
                      options.T_body_camera.rotation.isApprox(Eigen::Quaterniond::Identity());
    if (!same) {
      body.R_reference_other = moved.matrix3();
      body.t_reference_other = moved.translation;
    }
    const auto offset = Time::from_seconds(options.navigator.camera_time_offset).nanoseconds;
    const auto error = evaluation::score({Time{m.t1.nanoseconds + offset}, Time{m.t2.nanoseconds + offset},
                                          body, m.pose.scale_valid, m.pose.direction_valid},
                                         log.truth);
    if (error) errors.push_back(*error);
  }
  if (errors.empty()) return std::nullopt;
  return evaluation::summarise(errors);
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

}  // namespace

Result<CheckedLog> read_checked_log(const std::filesystem::path& folder,
                                    const io::NavigationLogOptions& options) {
  auto log = io::read_navigation_log(folder, options);
  if (!log) return log.error();
  CheckedLog checked{std::move(*log), {}};
  auto regularised = navigation::regularise_stamps(checked.log.imu);
  checked.hints = navigation::check_log(checked.log);
  if (regularised) checked.hints.push_back(std::move(*regularised));
  return checked;
}

std::vector<Hint> all_hints(const CheckedLog& checked, const NavigationRun& run) {
  std::vector<Hint> hints = checked.hints;
  const auto of_run = navigation::check_run(run.sensors, run.health, checked.log.imu.size());
  hints.insert(hints.end(), of_run.begin(), of_run.end());
  std::stable_sort(hints.begin(), hints.end(),
                   [](const Hint& a, const Hint& b) { return a.severity > b.severity; });
  return hints;
}

Error never_aligned(const std::string& folder, const CheckedLog& checked, const NavigationRun& run) {
  std::string text = fmt::format("{}: the filter never found its attitude and yaw (status: {})", folder,
                                 to_name(run.health.status));
  const std::vector<Hint> hints = all_hints(checked, run);
  for (const Hint& hint : hints) text += fmt::format("\n  {}\n  -> {}", hint.message, hint.advice);
  if (hints.empty()) {
    text += ", expected two seconds at rest and a heading, or GNSS velocities of a vehicle that accelerates";
  }
  for (const std::string& remark : checked.log.remarks) text += "\n  " + remark;
  return Error{text};
}

NavigationRun run_navigation(const NavigationLog& log, const NavigationRunOptions& options) {
  NavigationRun run;
  navigation::Navigator navigator(options.navigator);
  navigator.on_retired([&run](const navigation::Measurement& m) { run.measurements.push_back(m); });
  std::vector<Time> frames = options.frames.empty() ? regular_times(log, options.rate) : options.frames;
  std::sort(frames.begin(), frames.end());
  navigation::ReplayOptions replay;
  if (options.heading) replay.headings.push_back(*options.heading);
  if (options.on_road) replay.road_rate = 5;

  const auto offset = Time::from_seconds(options.navigator.camera_time_offset).nanoseconds;
  std::size_t next = 0;
  navigation::replay(log, navigator, replay, [&](Time now) {
    for (; next < frames.size() && frames[next].nanoseconds + offset <= now.nanoseconds; ++next) {
      const Time t = frames[next];
      const auto pose = navigator.absolute_pose(t);
      if (pose.answer != Answer::valid) {
        ++run.frames_without_answer;
        continue;
      }
      if (next > 0 && !run.frames.empty() && run.frames.back().time == frames[next - 1]) {
        const auto motion = navigator.relative_pose(frames[next - 1], t, options.T_body_camera);
        if (motion.answer == Answer::valid) run.motions.push_back({frames[next - 1], t, motion});
      }
      run.frames.push_back({t, pose, navigator.health().status});
    }
  });
  run.frames_without_answer += frames.size() - next;
  run.health = navigator.health();
  run.sensors = navigation::summarise(run.measurements);
  run.score = score_motions(log, options, run.motions);
  return run;
}

std::string format_trajectory(const NavigationRun& run) {
  std::string text = "# t_s x y z qx qy qz qw (T_world_body, world ENU, body FLU)\n";
  for (const NavigationFrame& frame : run.frames) {
    const Eigen::Vector3d& p = frame.pose.T_world_body.translation;
    const Eigen::Quaterniond& q = frame.pose.T_world_body.rotation;
    fmt::format_to(std::back_inserter(text), "{} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                   to_string(frame.time), p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string format_relative_motion(const NavigationRun& run) {
  std::string text =
      "# frame 2 in frame 1; covariance of (translation, rotation vector) in frame 1, row by row\n"
      "t1_s,t2_s,tx,ty,tz,qx,qy,qz,qw,scale_valid,direction_valid,status";
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) fmt::format_to(std::back_inserter(text), ",c{}{}", i, j);
  }
  text += '\n';
  for (const FrameMotion& m : run.motions) {
    const Eigen::Vector3d& t = m.pose.motion.t_reference_other;
    const Eigen::Quaterniond q(m.pose.motion.R_reference_other);
    fmt::format_to(std::back_inserter(text),
                   "{},{},{:.9g},{:.9g},{:.9g},{:.12g},{:.12g},{:.12g},{:.12g},{},{},{}", to_string(m.t1),
                   to_string(m.t2), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(),
                   m.pose.scale_valid ? 1 : 0, m.pose.direction_valid ? 1 : 0, to_name(m.pose.status));
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j)
        fmt::format_to(std::back_inserter(text), ",{:.6g}", m.pose.motion.covariance(i, j));
    }
    text += '\n';
  }
  return text;
}

Result<CameraTrajectory> camera_trajectory_from_imu_gnss(const std::filesystem::path& folder,
                                                         const std::vector<Time>& frames,
                                                         const CameraMounting& mounting,
                                                         const navigation::NavigatorOptions& options) {
  const auto checked = read_checked_log(folder);
  if (!checked) return checked.error();
  const NavigationLog* const log = &checked->log;
  if (log->gnss.velocities.empty() || log->gnss.fixes.empty()) {
    return Error{fmt::format("{}: no GNSS positions and velocities found, expected them in gnss.csv",
                             folder.string())};
  }
  NavigationRunOptions run_options;
  run_options.navigator = options;
  run_options.navigator.camera_time_offset = mounting.time_offset;
  run_options.navigator.gnss_lever_arm =
      mounting.gnss_lever_arm.value_or(log->gnss.lever_arm.value_or(options.gnss_lever_arm));
  run_options.frames = frames;
  run_options.T_body_camera = mounting.T_body_camera;
  const NavigationRun run = run_navigation(*log, run_options);

  CameraTrajectory trajectory;
  trajectory.origin = log->gnss.origin;
  trajectory.health = run.health;
  trajectory.hints = all_hints(*checked, run);
  const std::span<const FrameMotion> chain = longest_chain(run.motions);
  if (!chain.empty()) {
    const Time start = chain.front().t1;
    const auto first = std::find_if(run.frames.begin(), run.frames.end(),
                                    [&](const NavigationFrame& frame) { return frame.time == start; });
    trajectory.times = {start};
    trajectory.poses = {camera_pose(first->pose.T_world_body, mounting.T_body_camera)};
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
  if (trajectory.times.empty()) {
    return never_aligned(folder.string(), *checked, run);
  }
  return trajectory;
}

std::vector<std::string> notes_on(const CameraTrajectory& trajectory) {
  std::vector<std::string> notes;
  for (const Hint& hint : trajectory.hints)
    notes.push_back(fmt::format("{} -> {}", hint.message, hint.advice));
  const auto motions = trajectory.motions.size();
  const auto false_of = [](const std::vector<bool>& flags) {
    return std::count(flags.begin(), flags.end(), false);
  };
  if (const auto doubtful = false_of(trajectory.scale_valid); doubtful > 0) {
    notes.push_back(
        fmt::format("{} of {} motions between frames are too short for what the filter knows of their length "
                    "(scale_valid false)",
                    doubtful, motions));
  }
  if (const auto doubtful = false_of(trajectory.direction_valid); doubtful > 0) {
    notes.push_back(
        fmt::format("{} of {} motions between frames have a direction that the filter hardly knows "
                    "(direction_valid false)",
                    doubtful, motions));
  }
  if (trajectory.frames_left > 0) {
    notes.push_back(fmt::format(
        "the filter had to start anew: {} frames with a pose of their own are left out, the {} of the "
        "longest unbroken chain are kept",
        trajectory.frames_left, trajectory.times.size()));
  }
  return notes;
}

io::PoseSource poses_from_imu_gnss(const navigation::NavigatorOptions& options) {
  return [options](const std::filesystem::path& folder, const std::vector<Time>& images,
                   const io::Calibration& calibration) -> Result<io::ComputedPoses> {
    if (!calibration.T_body_camera) {
      return Error{
          fmt::format("{}: field T_body_camera is missing in the calibration, expected it because the poses "
                      "come from the "
                      "body's sensors",
                      folder.string())};
    }
    const CameraMounting mounting{*calibration.T_body_camera, calibration.time_offset_s.value_or(0),
                                  calibration.gnss_lever_arm};
    const auto trajectory = camera_trajectory_from_imu_gnss(folder, images, mounting, options);
    if (!trajectory) return trajectory.error();
    io::ComputedPoses result;
    for (std::size_t i = 0; i < trajectory->times.size(); ++i) {
      result.poses.push_back({trajectory->times[i], trajectory->poses[i]});
      result.covariances.push_back(i > 0 ? trajectory->motions[i - 1].covariance : Matrix6d::Zero());
    }
    result.motions_without_scale = static_cast<std::size_t>(
        std::count(trajectory->scale_valid.begin(), trajectory->scale_valid.end(), false));
    result.notes = notes_on(*trajectory);
    return result;
  };
}

}  // namespace pade
