// How good a navigation solution is for depth: errors of the relative motion, their consistency with the
// filter's own covariance, and the honesty of `scale_valid`.
#pragma once

#include <optional>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/core/time.hpp"

namespace pade::evaluation {

/// The truth at a time: linear interpolation between two states at most 0.1 s apart, nothing outside.
std::optional<TrueState> truth_at(const std::vector<TrueState>& truth, Time time);

/// An estimated motion of the body between two times.
struct EstimatedMotion {
  Time t1;
  Time t2;
  RelativeMotion motion;  ///< reference: t1
  bool scale_valid = false;
  bool direction_valid = false;
};

/// One pair scored against the truth.
struct MotionError {
  Time t2;
  double translation = 0;         ///< norm of the error in the frame at t1, m
  double rotation = 0;            ///< angle, rad
  double baseline = 0;            ///< true distance, m
  double estimated_baseline = 0;  ///< m
  double sigma = 0;               ///< predicted: root of the trace of the translation's covariance, m
  double length = 0;              ///< error of the length, without sign, m
  double length_sigma = 0;        ///< predicted along the estimated baseline, m
  double direction = 0;           ///< angle between the estimated and the true baseline, rad
  double direction_sigma =
      0;            ///< predicted scale of its tail: root of tr Q² / tr Q, Q across, m, over the baseline
  double nees = 0;  ///< normalised error squared of the translation, 3 degrees of freedom
  double length_nees = 0;     ///< the same of the length, 1 degree of freedom
  double direction_nees = 0;  ///< of the error across the estimated baseline, 2 degrees of freedom
  double rotation_nees = 0;   ///< of the rotation, 3 degrees of freedom
  double pose_nees = 0;       ///< of translation and rotation together, 6 degrees of freedom
  bool scale_valid = false;
  bool direction_valid = false;
};

std::optional<MotionError> score(const EstimatedMotion& estimate, const std::vector<TrueState>& truth);

/// The value below which a share of the values lies (0.95: the 95 % figure); NaN if there are none.
double quantile(std::vector<double> values, double share);

struct MotionSummary {
  std::size_t pairs = 0;
  double translation_median = 0;   ///< m
  double translation_95 = 0;       ///< m
  double relative_median = 0;      ///< error over true baseline
  double rotation_95 = 0;          ///< rad
  double nees_mean = 0;            ///< of the translation, 3 expected
  double rotation_nees_mean = 0;   ///< 3 expected
  double length_nees_mean = 0;     ///< 1 expected
  double direction_nees_mean = 0;  ///< 2 expected
  double pose_nees_mean = 0;       ///< 6 expected
  double direction_95 = 0;         ///< rad
  std::size_t good = 0;            ///< pairs whose length is wrong by less than 10 % of the baseline
  std::size_t bad = 0;             ///< by more than 20 %
  double valid_where_good = 0;     ///< share of the good pairs that are scale_valid
  double invalid_where_bad = 0;    ///< share of the bad pairs that are not
  std::size_t direction_good = 0;  ///< pairs whose direction is wrong by less than 0.175 rad
  std::size_t direction_bad = 0;   ///< by more than 0.35 rad
  double direction_valid_where_good = 0;
  double direction_invalid_where_bad = 0;
};

MotionSummary summarise(const std::vector<MotionError>& errors);

}  // namespace pade::evaluation
