#include "pade/report/navigation_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "pade/report/plot/simple_plot.hpp"
#include "pade/report/report_text.hpp"

namespace pade {
namespace {

using evaluation::Series;
using evaluation::simple_plot;

const std::array<std::string, 3> kColours = {"#0072b2", "#d55e00", "#009e73"};
const std::array<std::string, 3> kAxes = {"east", "north", "up"};

std::string innovation_plot(const NavigationRun& run, navigation::SensorKind kind, const std::string& title,
                            const std::string& unit) {
  std::vector<Series> series;
  for (std::size_t axis = 0; axis < 3; ++axis) series.push_back({kAxes[axis], kColours[axis], {}, {}, true});
  Series upper{"3 sigma, east", "#999999", {}, {}, false};
  for (const navigation::Measurement& m : run.measurements) {
    if (m.kind() != kind || m.innovation.size != 3 || m.innovation.sigma.x() > 100) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      series[axis].add(m.time.seconds(), m.innovation.residual[a]);
    }
    upper.add(m.time.seconds(), 3 * m.innovation.sigma.x());
  }
  if (series[0].x.empty()) return {};
  series.push_back(upper);
  return simple_plot(title, "time, s", "innovation, " + unit, series, false);
}

/// The truth of the body at the stamps of the images.
std::vector<TrueState> truth_at_stamps(const NavigationLog& log, const NavigationRunOptions& options) {
  const auto offset = Time::from_seconds(options.navigator.camera_time_offset).nanoseconds;
  std::vector<TrueState> truth = log.truth;
  for (TrueState& state : truth) state.time.nanoseconds -= offset;
  return truth;
}

/// The truth of what a run's motions are of: the camera, at the stamps of its images. (A motion of the body
/// made of the camera's would need its covariance moved too.)
std::vector<TrueState> camera_truth(const NavigationLog& log, const NavigationRunOptions& options) {
  std::vector<TrueState> truth = truth_at_stamps(log, options);
  for (TrueState& state : truth) state.T_world_body = camera_pose(state.T_world_body, options.T_body_camera);
  return truth;
}

std::optional<evaluation::MotionError> error_of(const FrameMotion& m, const std::vector<TrueState>& truth) {
  return evaluation::score({m.t1, m.t2, m.pose.motion, m.pose.scale_valid, m.pose.direction_valid}, truth);
}

std::string path_plots(const NavigationLog& log, const std::vector<TrueState>& true_states,
                       const NavigationRun& run) {
  Series path{"filter", kColours[0], {}, {}, false};
  Series fixes{"GNSS", "#999999", {}, {}, true};
  Series truth{"truth", kColours[1], {}, {}, false};
  Series speed{"speed", kColours[0], {}, {}, false};
  Series true_speed{"true speed", kColours[1], {}, {}, false};
  for (const NavigationFrame& f : run.frames) {
    path.add(f.pose.T_world_body.translation.x(), f.pose.T_world_body.translation.y());
    speed.add(f.time.seconds(), f.pose.velocity.norm());
    if (const auto t = evaluation::truth_at(true_states, f.time)) {
      truth.add(t->T_world_body.translation.x(), t->T_world_body.translation.y());
      true_speed.add(f.time.seconds(), t->velocity.norm());
    }
  }
  for (const GnssFix& fix : log.gnss.fixes) fixes.add(fix.position.x(), fix.position.y());
  std::vector<Series> map = {fixes, path};
  std::vector<Series> speeds = {speed};
  if (!truth.x.empty()) {
    map.push_back(truth);
    speeds.push_back(true_speed);
  }
  return simple_plot("Path", "east, m", "north, m", map, true) +
         simple_plot("Speed", "time, s", "m/s", speeds, false);
}

std::string baseline_plot(const std::vector<TrueState>& truth, const NavigationRun& run) {
  Series sigma{"predicted sigma", kColours[0], {}, {}, false};
  Series error{"error against truth", kColours[1], {}, {}, true};
  for (const FrameMotion& m : run.motions) {
    const double s = 100 * std::sqrt(m.pose.motion.covariance.topLeftCorner<3, 3>().trace());
    sigma.add(m.t2.seconds(), s);
    if (const auto e = error_of(m, truth)) error.add(m.t2.seconds(), 100 * e->translation);
  }
  std::vector<Series> series;
  if (!error.x.empty()) series.push_back(error);
  series.push_back(sigma);
  return simple_plot("Baseline between neighbouring frames", "time, s", "cm", series, false);
}

std::string health_table(const NavigationRun& run) {
  std::array<std::size_t, 5> verdicts{};
  std::string jumps;
  for (const navigation::Measurement& m : run.measurements) {
    ++verdicts[static_cast<std::size_t>(m.innovation.verdict)];
    if (m.innovation.verdict == navigation::Verdict::reacquired) {
      fmt::format_to(std::back_inserter(jumps), "<tr><td>re-acquired at {} s</td><td>{:.2f}</td></tr>\n",
                     to_string(m.time), m.innovation.jump);
    }
  }
  const navigation::Health& h = run.health.filter;
  return fmt::format(
      "<table><tr><th>health</th><th></th></tr>\n<tr><td>status at the end</td><td>{}</td></tr>\n"
      "<tr><td>frames with / without answer</td><td>{} / {}</td></tr>\n"
      "<tr><td>speed, median / largest</td><td>{:.2f} / {:.2f} m/s</td></tr>\n"
      "<tr><td>measurements accepted / inflated / rejected / re-acquired / before the start or "
      "unusable</td><td>{} / {} / {} / {} / {}</td></tr>\n"
      "<tr><td>IMU samples refused, gaps</td><td>{}, {}</td></tr>\n"
      "<tr><td>measurements too late, repeated, not finite</td><td>{}, {}, {}</td></tr>\n"
      "<tr><td>times lost / velocities doubted / magnetometer doubted / starts anew</td><td>{} / {} / {} / "
      "{}</td></tr>\n{}</table>\n",
      to_name(h.status), run.frames.size(), run.health.frames_without_answer, run.health.speed_median,
      run.health.speed_largest, verdicts[0], verdicts[1], verdicts[2], verdicts[3], verdicts[4],
      h.imu_refused, h.imu_gaps, h.too_late, h.duplicates, h.unusable, h.times_lost, h.velocity_doubted,
      h.magnetometer_doubted, h.restarts, jumps);
}

}  // namespace

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

std::optional<evaluation::MotionSummary> score_motions(const NavigationLog& log,
                                                       const NavigationRunOptions& options,
                                                       const NavigationRun& run) {
  if (log.truth.empty()) return std::nullopt;
  const std::vector<TrueState> truth = camera_truth(log, options);
  std::vector<evaluation::MotionError> errors;
  for (const FrameMotion& m : run.motions) {
    if (const auto error = error_of(m, truth)) errors.push_back(*error);
  }
  if (errors.empty()) return std::nullopt;
  return evaluation::summarise(errors);
}

std::string navigation_report(const std::string& title, const NavigationLog& log,
                              const NavigationRunOptions& options, const NavigationRun& run,
                              const std::optional<evaluation::MotionSummary>& score,
                              const std::string& figures) {
  std::string html = evaluation::begin_page(title, evaluation::plot_page_style, log.remarks);
  if (score) {
    html += fmt::format(
        "<table><tr><th>against truth, neighbouring frames</th><th></th></tr>\n"
        "<tr><td>translation, median / 95 %</td><td>{:.2f} / {:.2f} cm</td></tr>\n"
        "<tr><td>rotation, 95 %</td><td>{:.4f}°</td></tr>\n<tr><td>mean NEES of the translation (3 "
        "expected)</td><td>{:.2f}</td></tr>\n"
        "<tr><td>pairs</td><td>{}</td></tr></table>\n",
        100 * score->translation_median, 100 * score->translation_95, score->rotation_95 * 180 / M_PI,
        score->nees_mean, score->pairs);
  }
  html += health_table(run) + path_plots(log, truth_at_stamps(log, options), run) +
          baseline_plot(camera_truth(log, options), run);
  html += innovation_plot(run, navigation::SensorKind::gnss_velocity, "GNSS velocity", "m/s");
  html += innovation_plot(run, navigation::SensorKind::gnss_position, "GNSS position", "m");
  html +=
      innovation_plot(run, navigation::SensorKind::raw_gnss, "Velocity from the Doppler of raw GNSS", "m/s");
  html += figures;
  return html + "</main></body></html>\n";
}

}  // namespace pade
