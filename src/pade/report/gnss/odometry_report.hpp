// The files of a recording of raw GNSS that was played together with odometry.
#pragma once

#include <optional>
#include <string>

#include "pade/navigation/odometry/planar_run.hpp"
#include "pade/report/gnss/raw_gnss_report.hpp"

namespace pade {

/// "positions.csv": of each epoch the position in ENU with its σ, yaw, speed, and what was found of odometry
/// and clock.
std::string format_positions(const navigation::PlanarRun& run);

/// "trajectory.txt": TUM format, of the epochs whose yaw was known; T_world_body of the antenna.
std::string format_planar_trajectory(const navigation::PlanarRun& run);

/// "ranges.csv": what each satellite counted at each epoch, and the residual that is left.
std::string format_ranges(const navigation::PlanarRun& run);

/// Against the truth, and the mean of the squared horizontal error in units of its covariance (2 expected).
struct PlanarScore {
  RawScore score;
  double nees = 0;
};

/// Empty if no epoch has a truth.
std::optional<PlanarScore> score_planar(const gnss::RawLog& log, const navigation::PlanarRun& run);

/// One self-contained page: counts, path and errors beside those of each epoch alone, what each range
/// counted.
/// @param alone  the same log, epoch by epoch
std::string odometry_report(const std::string& title, const gnss::RawLog& log,
                            const navigation::PlanarRun& run, const gnss::RawRun& alone);

}  // namespace pade
