#include "pade/offline/calibration/gyro_track.hpp"

#include <algorithm>
#include <cmath>

#include "pade/core/compute/median.hpp"
#include "pade/core/pose.hpp"

namespace pade {

GyroTrack::GyroTrack(const std::vector<ImuSample>& samples) {
  for (const ImuSample& sample : samples) {
    if (!sample.angular_rate.allFinite() || (!times_.empty() && sample.time <= times_.back())) continue;
    times_.push_back(sample.time);
    rates_.push_back(sample.angular_rate);
  }
  if (empty()) return;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times_.size(); ++i)
    intervals.push_back(seconds_between(times_[i - 1], times_[i]));
  interval_ = median(std::vector<double>(intervals));
  constexpr double kGap = 0.1;  // s
  const double longest = std::max(kGap, 5 * interval_);
  turned_.emplace_back(Eigen::Quaterniond::Identity());
  gaps_.push_back(0);
  for (std::size_t i = 1; i < times_.size(); ++i) {
    const Eigen::Vector3d turn = 0.5 * intervals[i - 1] * (rates_[i - 1] + rates_[i]);
    turned_.push_back((turned_.back() * rotation_exp(turn)).normalized());
    gaps_.push_back(gaps_.back() + (intervals[i - 1] > longest ? 1 : 0));
  }
}

double GyroTrack::spread() const {
  const auto n = static_cast<double>(std::max<std::size_t>(1, rates_.size()));
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sum = 0;
  for (const Eigen::Vector3d& rate : rates_) mean += rate / n;
  for (const Eigen::Vector3d& rate : rates_) sum += (rate - mean).squaredNorm() / n;
  return std::sqrt(sum);
}

double GyroTrack::noise() const {
  std::vector<double> squares;
  for (std::size_t i = 2; i < rates_.size(); ++i)
    squares.push_back((rates_[i] - 2 * rates_[i - 1] + rates_[i - 2]).squaredNorm());
  constexpr double kMedian = 2.366;  // of chi-square of three
  return median(squares, 0.0) / kMedian / 6 * interval_;
}

std::optional<GyroTrack::At> GyroTrack::at(Time time) const {
  if (empty() || time < first() || time > last()) return std::nullopt;
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, time);
  const auto i = static_cast<std::size_t>(after - times_.begin()) - 1;
  const double length = seconds_between(times_[i], times_[i + 1]);
  const double t = seconds_between(times_[i], time);
  const Eigen::Vector3d change = rates_[i + 1] - rates_[i];
  const Eigen::Vector3d turn = t * rates_[i] + 0.5 * t * t / length * change;
  return At{i, (turned_[i] * rotation_exp(turn)).normalized(), rates_[i] + t / length * change};
}

std::optional<BodyTurn> GyroTrack::between(Time from, Time to) const {
  const auto a = at(from);
  const auto b = at(to);
  if (!a || !b || gaps_[a->interval] != gaps_[b->interval + 1]) return std::nullopt;
  return BodyTurn{a->R.conjugate() * b->R, a->rate, b->rate};
}

}  // namespace pade
