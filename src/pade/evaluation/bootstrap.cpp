#include "pade/evaluation/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "pade/core/random.hpp"

namespace pade::evaluation {
namespace {

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

// Student's t with a whole number of degrees of freedom (Abramowitz and Stegun 26.7.3, 26.7.4), t >= 0.
double student_cdf(double t, int freedom) {
  const double angle = std::atan(t / std::sqrt(freedom));
  const double cosine2 = std::cos(angle) * std::cos(angle);
  const bool odd = freedom % 2 == 1;
  double term = odd ? std::cos(angle) : 1;
  double sum = freedom > 1 ? term : 0;
  for (int k = odd ? 3 : 2; k < freedom; k += 2) {
    term *= cosine2 * (k - 1) / k;
    sum += term;
  }
  const double within = odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
  return 0.5 * (1 + within);
}

// The argument at which an increasing function of [from, to] reaches `value`.
template <class Function>
double invert(Function function, double value, double from, double to) {
  for (int step = 0; step < 100; ++step) {
    const double middle = 0.5 * (from + to);
    (function(middle) < value ? from : to) = middle;
  }
  return 0.5 * (from + to);
}

double normal_quantile(double share) { return invert(normal_cdf, share, -40, 40); }

double student_quantile(double share, int freedom) {
  return invert([freedom](double t) { return student_cdf(t, freedom); }, share, 0, 1e9);
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
