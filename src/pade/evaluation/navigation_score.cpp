#include "pade/evaluation/navigation_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pade::evaluation {

std::optional<TrueState> truth_at(const std::vector<TrueState>& truth, Time time) {
  constexpr double kLongest = 0.1;
  const auto after = std::lower_bound(truth.begin(), truth.end(), time,
                                      [](const TrueState& state, Time t) { return state.time < t; });
  if (after == truth.end()) return std::nullopt;
  if (after->time == time) return *after;
  if (after == truth.begin()) return std::nullopt;
  const TrueState& a = *(after - 1);
  const double interval = seconds_between(a.time, after->time);
  if (interval > kLongest) return std::nullopt;
  const double s = seconds_between(a.time, time) / interval;
  TrueState state;
  state.time = time;
  state.T_world_body.translation = (1 - s) * a.T_world_body.translation + s * after->T_world_body.translation;
  state.T_world_body.rotation = a.T_world_body.rotation.slerp(s, after->T_world_body.rotation);
  state.velocity = (1 - s) * a.velocity + s * after->velocity;
  return state;
}

namespace {

/// Errors along and across the estimated baseline.
void score_blocks(const RelativeMotion& motion, const Eigen::Vector3d& difference,
                  const Eigen::Vector3d& truth, MotionError& error) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  const Eigen::Vector3d d = t.normalized();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = d.unitOrthogonal();
  across.col(1) = d.cross(across.col(0));
  const Eigen::Matrix3d P = motion.covariance.topLeftCorner<3, 3>();
  const Eigen::Matrix2d Q = across.transpose() * P * across;
  const Eigen::Vector2d sideways = across.transpose() * difference;
  error.length = std::abs(t.norm() - truth.norm());
  error.length_sigma = std::sqrt(d.dot(P * d));
  error.length_nees = error.length * error.length / (error.length_sigma * error.length_sigma);
  error.direction = std::atan2(t.cross(truth).norm(), t.dot(truth));
  error.direction_sigma = Q.norm() / std::sqrt(Q.trace()) / t.norm();
  error.direction_nees = sideways.dot(Q.ldlt().solve(sideways));
}

}  // namespace

std::optional<MotionError> score(const EstimatedMotion& estimate, const std::vector<TrueState>& truth) {
  const auto first = truth_at(truth, estimate.t1);
  const auto second = truth_at(truth, estimate.t2);
  if (!first || !second) return std::nullopt;
  const Pose T = first->T_world_body.inverse() * second->T_world_body;
  MotionError error;
  error.t2 = estimate.t2;
  const Eigen::Vector3d difference = estimate.motion.t_reference_other - T.translation;
  error.translation = difference.norm();
  // exp(dθ) R = R_true, in the axes of the reference, as the covariance has it.
  const Eigen::Vector3d turn =
      rotation_log(Eigen::Matrix3d(T.matrix3() * estimate.motion.R_reference_other.transpose()));
  error.rotation = turn.norm();
  error.rotation_nees = turn.dot(estimate.motion.covariance.bottomRightCorner<3, 3>().ldlt().solve(turn));
  error.baseline = T.translation.norm();
  error.estimated_baseline = estimate.motion.t_reference_other.norm();
  error.sigma = std::sqrt(estimate.motion.covariance.topLeftCorner<3, 3>().trace());
  error.nees = difference.dot(estimate.motion.covariance.topLeftCorner<3, 3>().ldlt().solve(difference));
  Eigen::Matrix<double, 6, 1> both;  // the motion as it is less the estimate, as the covariance has it
  both << -difference, turn;
  error.pose_nees = both.dot(estimate.motion.covariance.ldlt().solve(both));
  score_blocks(estimate.motion, difference, T.translation, error);
  error.scale_valid = estimate.scale_valid;
  error.direction_valid = estimate.direction_valid;
  return error;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double rank = share * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(rank);
  std::sort(values.begin(), values.end());
  const double above = low + 1 < values.size() ? values[low + 1] : values[low];
  return values[low] + (rank - static_cast<double>(low)) * (above - values[low]);
}

namespace {
constexpr double kWrongDirection = 0.35;  // rad
}

MotionSummary summarise(const std::vector<MotionError>& errors) {
  std::vector<double> translation;
  std::vector<double> relative;
  std::vector<double> rotation;
  double nees = 0;
  double rotation_nees = 0;
  double length_nees = 0;
  double direction_nees = 0;
  double pose_nees = 0;
  std::vector<double> direction;
  std::size_t direction_good = 0;
  std::size_t direction_good_valid = 0;
  std::size_t direction_bad = 0;
  std::size_t direction_bad_invalid = 0;
  std::size_t good = 0;
  std::size_t good_valid = 0;
  std::size_t bad = 0;
  std::size_t bad_invalid = 0;
  for (const MotionError& error : errors) {
    translation.push_back(error.translation);
    rotation.push_back(error.rotation);
    if (error.baseline > 0) relative.push_back(error.translation / error.baseline);
    nees += error.nees;
    rotation_nees += error.rotation_nees;
    length_nees += error.length_nees;
    direction_nees += error.direction_nees;
    pose_nees += error.pose_nees;
    direction.push_back(error.direction);
    if (error.length < 0.1 * error.baseline) {
      ++good;
      good_valid += error.scale_valid ? 1 : 0;
    } else if (error.length > 0.2 * error.baseline) {
      ++bad;
      bad_invalid += error.scale_valid ? 0 : 1;
    }
    if (error.direction < 0.5 * kWrongDirection) {
      ++direction_good;
      direction_good_valid += error.direction_valid ? 1 : 0;
    } else if (error.direction > kWrongDirection) {
      ++direction_bad;
      direction_bad_invalid += error.direction_valid ? 0 : 1;
    }
  }
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                     : std::numeric_limits<double>::quiet_NaN();
  };
  MotionSummary summary;
  summary.pairs = errors.size();
  summary.translation_median = quantile(translation, 0.5);
  summary.translation_95 = quantile(translation, 0.95);
  summary.relative_median = quantile(relative, 0.5);
  summary.rotation_95 = quantile(rotation, 0.95);
  const double count =
      errors.empty() ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(errors.size());
  summary.nees_mean = nees / count;
  summary.rotation_nees_mean = rotation_nees / count;
  summary.length_nees_mean = length_nees / count;
  summary.direction_nees_mean = direction_nees / count;
  summary.pose_nees_mean = pose_nees / count;
  summary.direction_95 = quantile(direction, 0.95);
  summary.direction_good = direction_good;
  summary.direction_bad = direction_bad;
  summary.direction_valid_where_good = share(direction_good_valid, direction_good);
  summary.direction_invalid_where_bad = share(direction_bad_invalid, direction_bad);
  summary.good = good;
  summary.bad = bad;
  summary.valid_where_good = share(good_valid, good);
  summary.invalid_where_bad = share(bad_invalid, bad);
  return summary;
}

}  // namespace pade::evaluation
