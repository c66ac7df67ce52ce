#include "pade/report/gnss/raw_gnss_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/report/plot/simple_plot.hpp"
#include "pade/report/report_text.hpp"

namespace pade {
namespace {

using evaluation::rows_plot;
using evaluation::Series;
using evaluation::simple_plot;
using gnss::EpochResult;
using gnss::SatelliteView;
using gnss::Use;
using RawPointer = std::shared_ptr<const navigation::RawEpoch>;

constexpr double kDegrees = 180 / std::numbers::pi;
const std::array<std::string, gnss::kSystems> kSystemNames = {"GPS", "GLONASS", "Galileo", "BeiDou"};
const std::array<std::string, gnss::kSystems> kSystemColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7"};

/// The local axes of a run: ENU at its first position.
struct LocalFrame {
  Eigen::Vector3d origin;
  gnss::Geodetic place;
  Eigen::Matrix3d R_enu_ecef;
};

std::optional<LocalFrame> local_frame(const gnss::RawRun& run) {
  const auto first = std::find_if(run.epochs.begin(), run.epochs.end(),
                                  [](const EpochResult& e) { return e.position.has_value(); });
  if (first == run.epochs.end()) return std::nullopt;
  const gnss::Geodetic place = gnss::geodetic_of(first->position->position);
  return LocalFrame{first->position->position, place, gnss::enu_axes(place)};
}

void add_vector(std::string& text, const Eigen::Vector3d& v, int digits) {
  fmt::format_to(std::back_inserter(text), ",{:.{}f},{:.{}f},{:.{}f}", v.x(), digits, v.y(), digits, v.z(),
                 digits);
}

/// A vector in ENU and its σ, or six empty fields.
template <class Fix>
void add_enu(std::string& text, const std::optional<Fix>& fix, const Eigen::Vector3d& ecef,
             const LocalFrame& frame, int digits) {
  if (!fix) {
    text += ",,,,,,";
    return;
  }
  add_vector(text, frame.R_enu_ecef * ecef, digits);
  const Eigen::Matrix3d covariance = frame.R_enu_ecef * fix->covariance * frame.R_enu_ecef.transpose();
  add_vector(text, covariance.diagonal().cwiseMax(0).cwiseSqrt(), digits);
}

/// A residual, or nothing where it was not measured.
void add_residual(std::string& text, Use use, double residual) {
  const bool known = use == Use::used || use == Use::outlier;
  fmt::format_to(std::back_inserter(text), ",{},", gnss::to_name(use));
  if (known) fmt::format_to(std::back_inserter(text), "{:.5f}", residual);
}

using SystemSeries = std::array<Series, gnss::kSystems>;

SystemSeries system_series() {
  SystemSeries series;
  for (std::size_t i = 0; i < gnss::kSystems; ++i) {
    series.at(i) = {kSystemNames.at(i), kSystemColours.at(i), {}, {}, true};
  }
  return series;
}

std::string plot_of(const std::string& title, const std::string& x, const std::string& y,
                    const SystemSeries& all, bool equal) {
  std::vector<Series> shown;
  std::copy_if(all.begin(), all.end(), std::back_inserter(shown),
               [](const Series& s) { return !s.x.empty(); });
  return shown.empty() ? std::string() : simple_plot(title, x, y, shown, equal);
}

/// The zenith in the middle, the horizon at 90, north up.
std::string sky_plot(const gnss::RawRun& run) {
  SystemSeries series = system_series();
  const std::size_t stride = std::max<std::size_t>(1, run.epochs.size() / 60);
  for (std::size_t i = 0; i < run.epochs.size(); i += stride) {
    for (const SatelliteView& v : run.epochs[i].satellites) {
      if (v.use != Use::used && v.use != Use::outlier && v.use != Use::low) continue;
      const double zenith_angle = 90 - v.direction.elevation * kDegrees;
      series.at(static_cast<std::size_t>(v.satellite.system))
          .add(zenith_angle * std::sin(v.direction.azimuth), zenith_angle * std::cos(v.direction.azimuth));
    }
  }
  return plot_of("Sky: angle from the zenith, north up", "east, degrees", "north, degrees", series, true);
}

/// One kind of residual of what was used, at most some 20 000 points.
template <class UseOf, class ResidualOf>
std::string residual_plot(const gnss::RawRun& run, const std::string& title, const std::string& unit,
                          UseOf use_of, ResidualOf residual_of) {
  SystemSeries series = system_series();
  const std::size_t stride = std::max<std::size_t>(1, run.epochs.size() / 700);
  for (std::size_t i = 0; i < run.epochs.size(); i += stride) {
    const double t = seconds_between(run.epochs.front().time, run.epochs[i].time);
    for (const SatelliteView& v : run.epochs[i].satellites) {
      if (use_of(v) == Use::used)
        series.at(static_cast<std::size_t>(v.satellite.system)).add(t, residual_of(v));
    }
  }
  return plot_of(title, "time, s", unit, series, false);
}

/// The rows of a figure, one for each satellite, and the events in them.
class SlipRows {
 public:
  void expect(gnss::SatelliteId satellite) { rows_[satellite] = 0; }
  /// To be called when all satellites are known.
  void number() {
    for (auto& [satellite, row] : rows_) {
      row = static_cast<double>(names_.size());
      names_.push_back(to_string(satellite));
    }
  }
  /// What the receiver says of a phase, and else whether it was found.
  void judge(double t, gnss::SatelliteId satellite, bool lost_lock, bool half_cycle, bool found) {
    const auto [before, first] = half_cycle_.try_emplace(satellite, half_cycle);
    const bool changed = !first && before->second != half_cycle;
    before->second = half_cycle;
    if (lost_lock || changed || found) {
      (lost_lock ? lock_ : changed ? half_ : found_).add(t, rows_.at(satellite));
    }
  }
  void refuse_range(double t, gnss::SatelliteId satellite) { range_.add(t, rows_.at(satellite)); }
  [[nodiscard]] std::string figure(const std::string& title) const {
    if (rows_.empty()) return {};
    return rows_plot(title, "time, s", names_, {lock_, half_, found_, range_});
  }

 private:
  std::map<gnss::SatelliteId, double> rows_;
  std::map<gnss::SatelliteId, bool> half_cycle_;  // as it was last
  std::vector<std::string> names_;
  Series lock_{"lock lost", "#0072b2", {}, {}, true};
  Series half_{"half a cycle flagged", "#e69f00", {}, {}, true};
  Series found_{"found by the gate", "#d55e00", {}, {}, true};
  Series range_{"range refused", "#9aa5b1", {}, {}, true};
};

std::string path_plot(const gnss::RawLog& log, const gnss::RawRun& run, const LocalFrame& frame) {
  Series path{"positions", "#0072b2", {}, {}, true};
  Series truth{"truth", "#d55e00", {}, {}, false};
  for (const EpochResult& e : run.epochs) {
    if (!e.position) continue;
    const Eigen::Vector3d p = frame.R_enu_ecef * (e.position->position - frame.origin);
    path.add(p.x(), p.y());
  }
  for (const gnss::TruePosition& point : log.truth) {
    const Eigen::Vector3d p = frame.R_enu_ecef * (point.position - frame.origin);
    truth.add(p.x(), p.y());
  }
  std::vector<Series> series{path};
  if (!truth.x.empty()) series.push_back(truth);
  return simple_plot("Path", "east, m", "north, m", series, true);
}

std::string counts_table(const gnss::RawRun& run, const std::optional<RawScore>& score) {
  const RawSummary s = summary_of(run);
  std::string html = fmt::format(
      "<table><tr><th>epochs</th><th></th></tr>\n<tr><td>all / with position / with velocity / with a step "
      "of "
      "phases</td><td>{} / {} / {} / {}</td></tr>\n<tr><td>satellites in a position, "
      "mean</td><td>{:.1f}</td></tr>\n"
      "<tr><td>residuals, rms: pseudorange, range rate, phase</td><td>{:.2f} m, {:.3f} m/s, {:.1f} "
      "mm</td></tr>\n"
      "<tr><td>phases refused</td><td>{}</td></tr>\n",
      s.epochs, s.with_position, s.with_velocity, s.with_step, s.satellites, s.range_rms, s.rate_rms,
      1e3 * s.phase_rms, s.slips);
  for (std::size_t i = 0; i < gnss::kUses; ++i) {
    fmt::format_to(std::back_inserter(html), "<tr><td>satellites: {}</td><td>{}</td></tr>\n",
                   gnss::to_name(static_cast<Use>(i)), run.uses.at(i));
  }
  if (score) {
    fmt::format_to(
        std::back_inserter(html),
        "<tr><td>against truth, horizontal: median, rms, 95 %; vertical: rms</td><td>{:.2f}, {:.2f}, "
        "{:.2f} m; {:.2f} m</td></tr>\n",
        score->horizontal_median, score->horizontal_rms, score->horizontal_95, score->vertical_rms);
  }
  return html + "</table>\n";
}

/// Sum of squares and count.
struct MeanSquare {
  double sum = 0;
  std::size_t count = 0;
  void add(Use use, double value) {
    if (use != Use::used) return;
    sum += value * value;
    ++count;
  }
  [[nodiscard]] double root() const { return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0; }
};

}  // namespace

std::optional<GnssLog> gnss_log_of(const gnss::RawRun& run) {
  const auto frame = local_frame(run);
  if (!frame) return std::nullopt;
  GnssLog log;
  log.origin = {frame->place.latitude * kDegrees, frame->place.longitude * kDegrees, frame->place.height};
  const Eigen::Matrix3d& R = frame->R_enu_ecef;
  for (const EpochResult& e : run.epochs) {
    if (!e.position) continue;
    log.fixes.push_back(
        {e.time, R * (e.position->position - frame->origin), R * e.position->covariance * R.transpose()});
    if (!e.velocity) continue;
    log.velocities.push_back({e.time, R * e.velocity->velocity, R * e.velocity->covariance * R.transpose()});
  }
  return log;
}

std::string format_epochs(const gnss::RawRun& run) {
  std::string text =
      "# GPS time since 1980-01-06; ECEF; ENU at the first position; clocks of the receiver against each "
      "system, m\n"
      "t_s,x,y,z,pE,pN,pU,sE,sN,sU,satellites,redundancy,chi_square,clock_G,clock_R,clock_E,clock_C,"
      "vE,vN,vU,svE,svN,svU,clock_rate,step_from_s,dE,dN,dU,sdE,sdN,sdU,slips\n";
  const auto out = std::back_inserter(text);
  const auto frame = local_frame(run);
  if (!frame) return text;
  for (const EpochResult& e : run.epochs) {
    if (!e.position) continue;
    text += to_string(e.time);
    add_vector(text, e.position->position, 4);
    add_enu(text, e.position, e.position->position - frame->origin, *frame, 4);
    fmt::format_to(out, ",{},{},{:.3f}", e.position->used, e.position->redundancy, e.position->chi_square);
    for (const auto& clock : e.position->clock) {
      text += ',';
      if (clock) fmt::format_to(out, "{:.3f}", *clock);
    }
    add_enu(text, e.velocity, e.velocity ? e.velocity->velocity : frame->origin, *frame, 5);
    text += ',';
    if (e.velocity) fmt::format_to(out, "{:.5f}", e.velocity->clock_rate);
    text += ',';
    if (e.step) text += to_string(e.step->from);
    add_enu(text, e.step, e.step ? e.step->step : frame->origin, *frame, 5);
    text += ',';
    if (e.step) fmt::format_to(out, "{}", e.step->slips);
    text += '\n';
  }
  return text;
}

std::string format_residuals(const gnss::RawRun& run) {
  std::string text =
      "t_s,satellite,azimuth_deg,elevation_deg,cn0_dbhz,range_use,range_residual_m,rate_use,rate_residual_"
      "mps,"
      "phase_use,phase_residual_m\n";
  const auto out = std::back_inserter(text);
  for (const EpochResult& e : run.epochs) {
    for (const SatelliteView& v : e.satellites) {
      fmt::format_to(out, "{},{},{:.2f},{:.2f},{:.1f}", to_string(e.time), to_string(v.satellite),
                     v.direction.azimuth * kDegrees, v.direction.elevation * kDegrees, v.cn0);
      add_residual(text, v.use, v.range_residual);
      add_residual(text, v.rate_use, v.rate_residual);
      add_residual(text, v.phase_use, v.phase_residual);
      text += '\n';
    }
  }
  return text;
}

std::optional<RawScore> score_errors(const std::vector<Eigen::Vector3d>& errors) {
  if (errors.empty()) return std::nullopt;
  RawScore score;
  score.epochs = errors.size();
  std::vector<double> sizes;
  for (const Eigen::Vector3d& error : errors) {
    sizes.push_back(error.head<2>().norm());
    score.horizontal_rms += error.head<2>().squaredNorm();
    score.vertical_rms += error.z() * error.z();
  }
  std::sort(sizes.begin(), sizes.end());
  const auto count = static_cast<double>(errors.size());
  score.horizontal_median = sizes[sizes.size() / 2];
  score.horizontal_95 = sizes[sizes.size() * 95 / 100];
  score.horizontal_rms = std::sqrt(score.horizontal_rms / count);
  score.vertical_rms = std::sqrt(score.vertical_rms / count);
  return score;
}

std::optional<Eigen::Vector3d> truth_at(const gnss::RawLog& log, Time time) {
  const auto at = std::lower_bound(log.truth.begin(), log.truth.end(), time,
                                   [](const gnss::TruePosition& p, Time t) { return p.time < t; });
  if (at == log.truth.end() || at->time != time) return std::nullopt;
  return at->position;
}

std::optional<RawScore> score_positions(const gnss::RawLog& log, const gnss::RawRun& run) {
  std::vector<Eigen::Vector3d> errors;
  for (const EpochResult& e : run.epochs) {
    const auto truth = truth_at(log, e.time);
    if (!e.position || !truth) continue;
    errors.emplace_back(gnss::enu_axes(gnss::geodetic_of(*truth)) * (e.position->position - *truth));
  }
  return score_errors(errors);
}

RawSummary summary_of(const gnss::RawRun& run) {
  RawSummary s;
  MeanSquare range, rate, phase;
  double used = 0;
  for (const EpochResult& e : run.epochs) {
    ++s.epochs;
    if (e.position) {
      ++s.with_position;
      used += e.position->used;
    }
    if (e.velocity) ++s.with_velocity;
    if (e.step) {
      ++s.with_step;
      s.slips += static_cast<std::size_t>(e.step->slips);
    }
    for (const SatelliteView& v : e.satellites) {
      range.add(v.use, v.range_residual);
      rate.add(v.rate_use, v.rate_residual);
      phase.add(v.phase_use, v.phase_residual);
    }
  }
  if (s.with_position > 0) s.satellites = used / static_cast<double>(s.with_position);
  s.range_rms = range.root();
  s.rate_rms = rate.root();
  s.phase_rms = phase.root();
  return s;
}

std::string slip_plot(const gnss::RawRun& run) {
  SlipRows rows;
  for (const EpochResult& e : run.epochs) {
    for (const SatelliteView& v : e.satellites) {
      if (v.use == Use::used || v.use == Use::outlier) rows.expect(v.satellite);
    }
  }
  rows.number();
  for (const EpochResult& e : run.epochs) {
    const double t = seconds_between(run.epochs.front().time, e.time);
    for (const SatelliteView& v : e.satellites) {
      if (v.use != Use::used && v.use != Use::outlier) continue;
      if (v.use == Use::outlier) rows.refuse_range(t, v.satellite);
      if (v.signal == nullptr || !v.signal->carrier) continue;
      rows.judge(t, v.satellite, v.signal->lost_lock, v.signal->half_cycle, v.phase_use == Use::outlier);
    }
  }
  return rows.figure("Slips of the phases since the epoch before, and ranges refused");
}

std::string slip_plot(const NavigationRun& run) {
  if (run.raw.ranges.used + run.raw.phases.used == 0) return {};
  SlipRows rows;
  std::optional<Time> first;
  for (const navigation::Measurement& m : run.measurements) {
    const auto* raw = m.get_if<RawPointer>();
    if (raw == nullptr) continue;
    if (!first) first = m.time;
    for (const navigation::RawSatellite& s : (*raw)->satellites) rows.expect(s.satellite);
  }
  rows.number();
  for (const navigation::Measurement& m : run.measurements) {
    const auto* raw = m.get_if<RawPointer>();
    if (raw == nullptr) continue;
    const double t = seconds_between(*first, m.time);
    for (std::size_t i = 0; i < std::min<std::size_t>((*raw)->satellites.size(), 64); ++i) {
      const navigation::RawSatellite& s = (*raw)->satellites[i];
      const auto has = [&](std::uint64_t bits) { return (bits >> i & 1) != 0; };
      if (s.phase) rows.judge(t, s.satellite, s.lost_lock, s.half_cycle, has(m.innovation.refused_phases));
      if (has(m.innovation.refused_ranges)) rows.refuse_range(t, s.satellite);
    }
  }
  return rows.figure("Slips of the phases and ranges refused, as the filter's gates found them");
}

std::string raw_report(const std::string& title, const gnss::RawLog& log, const gnss::RawRun& run,
                       const std::optional<RawScore>& score) {
  std::string html = evaluation::begin_page(title, evaluation::plot_page_style, log.remarks);
  html += counts_table(run, score);
  if (const auto frame = local_frame(run)) html += path_plot(log, run, *frame);
  html += sky_plot(run);
  html += residual_plot(
      run, "Residuals of the pseudoranges", "m", [](const auto& v) { return v.use; },
      [](const auto& v) { return v.range_residual; });
  html += residual_plot(
      run, "Residuals of the range rates (Doppler)", "m/s", [](const auto& v) { return v.rate_use; },
      [](const auto& v) { return v.rate_residual; });
  html += residual_plot(
      run, "Residuals of the phases since the epoch before", "m", [](const auto& v) { return v.phase_use; },
      [](const auto& v) { return v.phase_residual; });
  html += slip_plot(run);
  return html + "</main></body></html>\n";
}

}  // namespace pade
