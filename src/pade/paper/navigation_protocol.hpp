// The protocol by which the filter is measured on recordings with truth (docs/navigation.md, "Protocol").
#pragma once

#include <cstdint>
#include <vector>

#include "pade/evaluation/navigation_score.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/replay.hpp"

namespace pade {

struct NavigationProtocol {
  double start = 27;        ///< data before this is not played, s
  double score_from = 57;   ///< s
  double score_to = 1e9;    ///< s
  double step = 0.1;        ///< between pairs, s
  double short_pair = 0.1;  ///< s
  double long_pair = 0.5;   ///< s
  double answer_delay = 0;  ///< the question is asked this long after t2 (of use where data comes late), s
  bool heading_given = true;
  double heading_sigma = 2;  ///< of the error of the given yaw, degrees
  std::uint64_t seed = 1;
  navigation::ReplayOptions replay;
};

struct NavigationFigures {
  std::vector<evaluation::MotionError> short_errors;
  std::vector<evaluation::MotionError> long_errors;
  evaluation::MotionSummary short_pairs;
  evaluation::MotionSummary long_pairs;
  double velocity_rms = 0;       ///< norm, m/s
  double tilt_rms = 0;           ///< angle between true and estimated vertical, rad
  double position_rms = 0;       ///< norm, m
  double yaw_error_end = 0;      ///< rad
  Time aligned;                  ///< when the yaw was first known
  double yaw_error_aligned = 0;  ///< at that time, rad
  bool finite = true;            ///< no NaN anywhere
  navigation::Health health;     ///< at the end
};

/// Runs the filter over the log and scores it against log.truth.
NavigationFigures run_protocol(const NavigationLog& log, const navigation::NavigatorOptions& options,
                               const NavigationProtocol& protocol);

}  // namespace pade
