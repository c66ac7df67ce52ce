#include "pade/depth/motion/stamp_clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "pade/core/compute/median.hpp"

namespace pade::depth {
namespace {

using Eigen::Vector3d;
constexpr std::size_t kMostSamples = 3 * 300;
constexpr double kLargestTurn = 0.1;    // rad between what poses and images say: more is no offset
constexpr double kLargestPeriod = 0.5;  // s between frames: beyond it no rate can be told
constexpr double kTellable = 0.01;      // s
constexpr double kUneven = 0.03;        // rad/s from one pair to the next
constexpr double kSigmas = 4;
constexpr double kLeastScatter = 1e-4;  // rad: no turn is known better
constexpr double kCorrelated = 2;       // so many pairs count as one
constexpr int kIterations = 10;
constexpr std::size_t kFewestPairs = 8;

/// Rate of turn at the middle of three frames, in its axes, rad/s.
Vector3d mean_rate(const Eigen::Quaterniond& before, const Eigen::Quaterniond& after, double seconds) {
  return rotation_log(before.conjugate() * after) / seconds;
}

/// The ratio that halves the weights: the line through the origin of least absolute residuals.
double median_ratio(std::vector<std::pair<double, double>> ratios) {
  std::sort(ratios.begin(), ratios.end());
  double total = 0;
  for (const auto& [ratio, weight] : ratios) total += weight;
  double passed = 0;
  for (const auto& [ratio, weight] : ratios) {
    passed += weight;
    if (2 * passed >= total) return ratio;
  }
  return 0;
}

}  // namespace

void StampClock::clear() {
  frames_.clear();
  samples_.clear();
}

bool StampClock::is_telling(Time stamp, const Pose& T_world_camera,
                            const std::optional<Vector3d>& rate) const {
  if (frames_.size() < 2) return false;
  const Turned& older = frames_[frames_.size() - 2];
  const Turned& last = frames_.back();
  if (rate && last.rate) return (*rate - *last.rate).norm() > kUneven;
  const Vector3d before =
      mean_rate(older.R_world_camera, last.R_world_camera, seconds_between(older.stamp, last.stamp));
  const Vector3d now =
      mean_rate(last.R_world_camera, T_world_camera.rotation, seconds_between(last.stamp, stamp));
  return (now - before).norm() > kUneven;
}

void StampClock::add(Time stamp, const Pose& T_world_camera, const std::optional<Vector3d>& rate,
                     const Vector3d& turn, const Eigen::Matrix3d& gain) {
  if (!frames_.empty() && !(seconds_between(frames_.back().stamp, stamp) < kLargestPeriod)) frames_.clear();
  frames_.push_back({stamp, T_world_camera.rotation, rate, turn, gain});
  if (frames_.size() < 4) return;
  // The pair is that of the two in the middle, whose rates are known by now.
  const auto rate_at = [this](std::size_t i) -> Vector3d {
    if (frames_[i].rate) return *frames_[i].rate;
    return mean_rate(frames_[i - 1].R_world_camera, frames_[i + 1].R_world_camera,
                     seconds_between(frames_[i - 1].stamp, frames_[i + 1].stamp));
  };
  const Turned& older = frames_[1];
  const Turned& newer = frames_[2];
  if (!newer.gain.isZero(0)) {
    const Eigen::Quaterniond R_newer_older = newer.R_world_camera.conjugate() * older.R_world_camera;
    const Vector3d per_second = -newer.gain * (rate_at(2) - R_newer_older * rate_at(1));
    if (newer.turn.norm() < kLargestTurn && per_second.allFinite() && newer.turn.allFinite()) {
      for (int i = 0; i < 3; ++i) samples_.push_back({newer.turn[i], per_second[i]});
      while (samples_.size() > kMostSamples) samples_.pop_front();
    }
  }
  frames_.pop_front();
}

std::optional<StampOffset> StampClock::found() const {
  std::vector<std::pair<double, double>> ratios;
  for (const Sample& s : samples_) {
    if (s.per_second != 0) ratios.emplace_back(s.asked / s.per_second, std::abs(s.per_second));
  }
  if (samples_.size() < 3 * kFewestPairs || ratios.empty()) return std::nullopt;
  double offset = median_ratio(std::move(ratios));
  std::vector<double> residuals(samples_.size());
  double scatter = 0;
  double squares = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::transform(samples_.begin(), samples_.end(), residuals.begin(),
                   [&](const Sample& s) { return std::abs(s.asked - offset * s.per_second); });
    scatter = std::max(kLeastScatter, median_to_sigma * median(residuals));
    squares = 0;
    double products = 0;
    for (const Sample& s : samples_) {
      const double u = (s.asked - offset * s.per_second) / (tukey_reach * scatter);
      const double weight = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
      squares += weight * s.per_second * s.per_second;
      products += weight * s.per_second * s.asked;
    }
    if (!(squares > 0)) return std::nullopt;
    offset = products / squares;
  }
  const double sigma = scatter * std::sqrt(kCorrelated / squares);
  if (!(kSigmas * sigma < kTellable)) return std::nullopt;
  return StampOffset{offset, sigma, samples_.size() / 3};
}

}  // namespace pade::depth
