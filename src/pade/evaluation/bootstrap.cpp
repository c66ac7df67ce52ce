#include "pade/evaluation/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include "pade/core/random.hpp"

namespace pade::evaluation {
namespace {

/// Where a share is 0 or 1 the quantile is infinite, and no error.
using Normal = boost::math::normal_distribution<
    double, boost::math::policies::policy<
                boost::math::policies::overflow_error<boost::math::policies::ignore_error>>>;

double normal_cdf(double z) { return cdf(Normal(), z); }
double normal_quantile(double share) { return quantile(Normal(), share); }
double student_quantile(double share, int freedom) {
  return quantile(boost::math::students_t(freedom), share);
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Means of sequences drawn with replacement, sorted.
std::vector<double> drawn_means(const std::vector<double>& values, std::uint64_t seed, int draws) {
  Random random(seed);
  const auto count = static_cast<double>(values.size());
  std::vector<double> means(static_cast<std::size_t>(draws));
  for (double& mean : means) {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += values[static_cast<std::size_t>(random.uniform() * count)];
    mean = sum / count;
  }
  std::sort(means.begin(), means.end());
  return means;
}

// Where the draws lie off the estimate, in standard deviations; draws equal to it count half.
double bias_of(const std::vector<double>& sorted, double estimate) {
  const double tie = 1e-12 * std::max(sorted.back() - sorted.front(), std::abs(estimate));
  const auto below = std::lower_bound(sorted.begin(), sorted.end(), estimate - tie) - sorted.begin();
  const auto above = sorted.end() - std::upper_bound(sorted.begin(), sorted.end(), estimate + tie);
  return normal_quantile(0.5 + 0.5 * static_cast<double>(below - above) / static_cast<double>(sorted.size()));
}

// A sixth of the skewness of the mean: how fast its standard deviation changes with it.
double acceleration_of(const std::vector<double>& values, double mean) {
  double squares = 0, cubes = 0;
  for (const double value : values) {
    squares += (value - mean) * (value - mean);
    cubes += std::pow(value - mean, 3);
  }
  return cubes / (6 * std::pow(squares, 1.5));
}

// The share of draws below the end of the interval that would be at `z` if draws were normal.
double corrected_share(double z, double bias, double acceleration) {
  const double moved = bias + z;
  const double shrink = 1 - acceleration * moved;
  // Past the pole the correction turns around: the end is then the last of the draws.
  return shrink > 0 ? normal_cdf(bias + moved / shrink) : normal_cdf(std::copysign(40, moved));
}

// The draw that a share of them stays below.
double quantile_of_sorted(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size()) - 0.5;
  const double last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::lround(std::clamp(rank, 0.0, last)))];
}

}  // namespace

Interval bootstrap_mean(std::span<const double> per_sequence, double level, std::uint64_t seed, int draws) {
  std::vector<double> values;
  std::copy_if(per_sequence.begin(), per_sequence.end(), std::back_inserter(values),
               [](double value) { return !std::isnan(value); });
  Interval interval;
  interval.count = static_cast<int>(values.size());
  if (values.empty()) return interval;
  interval.estimate = mean_of(values);
  if (values.size() < 2) return interval;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (*least == *most) {
    interval.estimate = interval.low = interval.high = *least;
    return interval;
  }
  const std::vector<double> means = drawn_means(values, seed, draws);
  const double few = static_cast<double>(interval.count) / (interval.count - 1);
  const double z = std::sqrt(few) * student_quantile(0.5 + 0.5 * level, interval.count - 1);
  double bias = bias_of(means, interval.estimate);
  double acceleration = acceleration_of(values, interval.estimate);
  if (!std::isfinite(acceleration) || std::abs(bias) > 39) bias = acceleration = 0;  // percentiles
  interval.low = quantile_of_sorted(means, corrected_share(-z, bias, acceleration));
  interval.high = quantile_of_sorted(means, corrected_share(z, bias, acceleration));
  return interval;
}

}  // namespace pade::evaluation
