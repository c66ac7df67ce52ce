#include "pade/report/gnss/odometry_report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "pade/report/plot/simple_plot.hpp"
#include "pade/report/report_text.hpp"

namespace pade {
namespace {

using evaluation::Series;
using navigation::PlanarEstimate;
using navigation::PlanarFrame;
using navigation::PlanarRun;
using navigation::RangeShare;

constexpr double kInDegrees = 180 / std::numbers::pi;
constexpr const char* kAloneColour = "#9aa5b1";
constexpr const char* kFilterColour = "#0072b2";
constexpr const char* kTruthColour = "#d55e00";

/// In the local axes of the run.
Eigen::Vector3d local(const PlanarRun& run, const Eigen::Vector3d& ecef) {
  return run.place->R_enu_ecef * (ecef - run.place->origin);
}

std::string drive_plot(const gnss::RawLog& log, const PlanarRun& run, const gnss::RawRun& alone) {
  Series points{"each epoch alone", kAloneColour, {}, {}, true};
  Series path{"with odometry", kFilterColour, {}, {}, false};
  Series truth{"truth", kTruthColour, {}, {}, false};
  for (const gnss::EpochResult& e : alone.epochs) {
    if (!e.position) continue;
    const Eigen::Vector3d p = local(run, e.position->position);
    points.add(p.x(), p.y());
  }
  for (const PlanarFrame& f : run.frames) path.add(f.estimate.position.x(), f.estimate.position.y());
  for (const gnss::TruePosition& t : log.truth) {
    const Eigen::Vector3d p = local(run, t.position);
    truth.add(p.x(), p.y());
  }
  std::vector<Series> series{points, path};
  if (!truth.x.empty()) series.push_back(truth);
  return evaluation::simple_plot("Path", "east, m", "north, m", series, true);
}

std::string error_plot(const gnss::RawLog& log, const PlanarRun& run, const gnss::RawRun& alone) {
  if (run.frames.empty()) return {};
  const Time zero = run.frames.front().estimate.time;
  Series points{"each epoch alone", kAloneColour, {}, {}, true};
  Series path{"with odometry", kFilterColour, {}, {}, false};
  Series sigma{"its standard deviation", "#009e73", {}, {}, false};
  for (const gnss::EpochResult& e : alone.epochs) {
    const auto truth = truth_at(log, e.time);
    if (!truth || !e.position) continue;
    const Eigen::Vector3d error = run.place->R_enu_ecef * (e.position->position - *truth);
    points.add(seconds_between(zero, e.time), error.head<2>().norm());
  }
  for (const PlanarFrame& f : run.frames) {
    const double t = seconds_between(zero, f.estimate.time);
    sigma.add(t, std::sqrt(f.estimate.covariance.topLeftCorner<2, 2>().trace()));
    if (const auto truth = truth_at(log, f.estimate.time)) {
      path.add(t, (f.estimate.position - local(run, *truth)).head<2>().norm());
    }
  }
  std::vector<Series> series{sigma};
  if (!path.x.empty()) series = {points, path, sigma};
  return evaluation::simple_plot(path.x.empty() ? "Horizontal standard deviation" : "Horizontal error",
                                 "time, s", "m", series, false);
}

/// Which satellite's range was doubted or refused, and when.
std::string doubt_plot(const PlanarRun& run) {
  std::map<gnss::SatelliteId, double> rows;
  for (const PlanarFrame& f : run.frames) {
    for (const RangeShare& s : f.shares) rows[s.satellite] = 0;
  }
  if (rows.empty()) return {};
  std::vector<std::string> names;
  for (auto& [satellite, row] : rows) {
    row = static_cast<double>(names.size());
    names.push_back(to_string(satellite));
  }
  Series doubted{"counts less than half", "#e69f00", {}, {}, true};
  Series refused{"refused", kTruthColour, {}, {}, true};
  for (const PlanarFrame& f : run.frames) {
    const double t = seconds_between(run.frames.front().estimate.time, f.estimate.time);
    for (const RangeShare& s : f.shares) {
      if (s.share < 0.5) (s.share > 0 ? doubted : refused).add(t, rows.at(s.satellite));
    }
  }
  return evaluation::rows_plot("Ranges that were doubted", "time, s", names, {doubted, refused});
}

void add_score(const char* name, const RawScore& s, std::string& html) {
  fmt::format_to(
      std::back_inserter(html),
      "<tr><td>{}: horizontal median, rms, 95 %; vertical rms ({} epochs)</td><td>{:.2f}, {:.2f}, {:.2f} m; "
      "{:.2f} m</td></tr>\n",
      name, s.epochs, s.horizontal_median, s.horizontal_rms, s.horizontal_95, s.vertical_rms);
}

}  // namespace

std::string format_positions(const PlanarRun& run) {
  std::string text =
      "# ENU at the first position; yaw from east towards north\n"
      "t_s,pE,pN,pU,sE,sN,sU,yaw_deg,yaw_sigma_deg,yaw_known,speed,scale,scale_sigma,yaw_rate_bias,clock,"
      "drift\n";
  for (const PlanarFrame& f : run.frames) {
    const PlanarEstimate& e = f.estimate;
    const Eigen::Vector3d sigma = e.covariance.diagonal().cwiseMax(0).cwiseSqrt();
    fmt::format_to(
        std::back_inserter(text),
        "{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{},{:.3f},{:.5f},{:.5f},{:.6f},{:.3f},"
        "{:.4f}\n",
        to_string(e.time), e.position.x(), e.position.y(), e.position.z(), sigma.x(), sigma.y(), sigma.z(),
        e.yaw * kInDegrees, e.yaw_sigma * kInDegrees, e.yaw_known ? 1 : 0, e.speed, e.scale, e.scale_sigma,
        e.yaw_rate_bias, e.clock, e.drift);
  }
  return text;
}

std::string format_planar_trajectory(const PlanarRun& run) {
  std::string text = "# t_s x y z qx qy qz qw (T_world_body, world ENU, body FLU, level)\n";
  for (const PlanarFrame& f : run.frames) {
    const PlanarEstimate& e = f.estimate;
    if (!e.yaw_known) continue;
    fmt::format_to(std::back_inserter(text), "{} {:.6f} {:.6f} {:.6f} 0 0 {:.9f} {:.9f}\n", to_string(e.time),
                   e.position.x(), e.position.y(), e.position.z(), std::sin(0.5 * e.yaw),
                   std::cos(0.5 * e.yaw));
  }
  return text;
}

std::string format_ranges(const PlanarRun& run) {
  std::string text =
      "# share of its full weight, 0: refused; residual that is left\nt_s,satellite,share,residual_m\n";
  for (const PlanarFrame& f : run.frames) {
    for (const RangeShare& s : f.shares) {
      fmt::format_to(std::back_inserter(text), "{},{},{:.4f},{:.3f}\n", to_string(f.estimate.time),
                     to_string(s.satellite), s.share, s.residual);
    }
  }
  return text;
}

std::optional<PlanarScore> score_planar(const gnss::RawLog& log, const PlanarRun& run) {
  std::vector<Eigen::Vector3d> errors;
  PlanarScore result;
  for (const PlanarFrame& f : run.frames) {
    const auto truth = truth_at(log, f.estimate.time);
    if (!truth) continue;
    errors.emplace_back(f.estimate.position - local(run, *truth));
    const Eigen::Matrix2d covariance = f.estimate.covariance.topLeftCorner<2, 2>();
    const Eigen::Vector2d error = errors.back().head<2>();
    result.nees += error.dot(covariance.ldlt().solve(error));
  }
  const auto score = score_errors(errors);
  if (!score) return std::nullopt;
  result.score = *score;
  result.nees /= static_cast<double>(errors.size());
  return result;
}

std::string odometry_report(const std::string& title, const gnss::RawLog& log, const PlanarRun& run,
                            const gnss::RawRun& alone) {
  std::string html = evaluation::begin_page(title, evaluation::plot_page_style, log.remarks);
  html += fmt::format(
      "<table><tr><th></th><th></th></tr>\n<tr><td>epochs with a position / all; samples of odometry; gaps "
      "in "
      "it</td><td>{} / {}; {}; {}</td></tr>\n"
      "<tr><td>ranges that counted / were doubted / refused</td><td>{} / {} / {}</td></tr>\n",
      run.frames.size(), log.known_ranges.size(), log.odometry.size(), run.tally.gaps, run.tally.counted,
      run.tally.doubted, run.tally.refused);
  if (const auto score = score_positions(log, alone)) add_score("each epoch alone", *score, html);
  if (const auto score = score_planar(log, run)) {
    add_score("with odometry", score->score, html);
    html += fmt::format(
        "<tr><td>squared error in its covariance, mean (2 is consistent)</td><td>{:.1f}</td></tr>\n",
        score->nees);
  }
  html += "</table>\n";
  if (run.place) html += drive_plot(log, run, alone) + error_plot(log, run, alone);
  return html + doubt_plot(run) + "</main></body></html>\n";
}

}  // namespace pade
