// The files of a recording of raw GNSS that was played epoch by epoch.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/navigation/navigation_run.hpp"

namespace pade {

/// "gnss.csv" of our own layout: positions and velocities in ENU at the first position. Empty if there is
/// none.
std::optional<GnssLog> gnss_log_of(const gnss::RawRun& run);

/// "epochs.csv": GPS time, position in ECEF and ENU with its σ, clocks, velocity, step since the epoch
/// before.
std::string format_epochs(const gnss::RawRun& run);

/// "residuals.csv": each satellite of each epoch with its direction, what became of it, and its residuals.
std::string format_residuals(const gnss::RawRun& run);

/// Positions against the truth at the same times.
struct RawScore {
  std::size_t epochs = 0;        ///< with a truth
  double horizontal_median = 0;  ///< m
  double horizontal_rms = 0;     ///< m
  double horizontal_95 = 0;      ///< 95 % are below, m
  double vertical_rms = 0;       ///< m
};

/// From errors in east, north and up, m. Empty if there are none.
std::optional<RawScore> score_errors(const std::vector<Eigen::Vector3d>& errors);

/// Empty if no epoch with a position has a truth.
std::optional<RawScore> score_positions(const gnss::RawLog& log, const gnss::RawRun& run);

/// The true position at a time; empty if there is none at just that time.
std::optional<Eigen::Vector3d> truth_at(const gnss::RawLog& log, Time time);

/// Root mean squares of the residuals of what was used, and counts.
struct RawSummary {
  std::size_t epochs = 0;
  std::size_t with_position = 0, with_velocity = 0, with_step = 0;  ///< epochs
  double satellites = 0;                                            ///< used for a position, mean
  double range_rms = 0;                                             ///< m
  double rate_rms = 0;                                              ///< m/s
  double phase_rms = 0;                                             ///< m
  std::size_t slips = 0;                                            ///< phases refused
};
RawSummary summary_of(const gnss::RawRun& run);

/// Which satellite's phase broke when, as a figure: flagged by the receiver, or found because it did not fit
/// the others; and whose range was refused.
std::string slip_plot(const gnss::RawRun& run);

/// The same of a run of the filter that took each satellite for itself. Empty where it took none.
std::string slip_plot(const NavigationRun& run);

/// One self-contained page: counts, path, sky, residuals, slips.
std::string raw_report(const std::string& title, const gnss::RawLog& log, const gnss::RawRun& run,
                       const std::optional<RawScore>& score);

}  // namespace pade
