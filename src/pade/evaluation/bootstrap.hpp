// How sure a mean over a few sequences is: a confidence interval by the bootstrap.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

namespace pade::evaluation {

/// A mean and the interval that holds the true one with the chosen confidence.
struct Interval {
  double estimate = std::numeric_limits<double>::quiet_NaN();  ///< the mean; NaN without values
  double low = std::numeric_limits<double>::quiet_NaN();       ///< NaN with fewer than two values
  double high = std::numeric_limits<double>::quiet_NaN();
  int count = 0;  ///< values it is made of

  /// The whole interval lies above (below) `value`; false if there is no interval.
  [[nodiscard]] bool above(double value) const { return low > value; }
  [[nodiscard]] bool below(double value) const { return high < value; }
};

/// The mean of `per_sequence` with its interval of confidence `level`: sequences are drawn with replacement,
/// and the interval is bias-corrected and accelerated (BCa: Efron, Better bootstrap confidence intervals,
/// 1987), widened for few sequences as Student's t is against the normal (Hesterberg, What teachers should
/// know about the bootstrap, 2015, Section 3.3). Without the widening a 95 % interval of ten normal values
/// holds the mean 91 % of the time (measured). Percentiles if the correction does not exist, no width
/// if all values are equal. An interval never leaves the range of the values, so that fewer than six
/// cannot give 95 %.
/// @param per_sequence  one value per sequence; NaN is left out. @param level  in (0, 1).
/// The same input gives the same interval.
Interval bootstrap_mean(std::span<const double> per_sequence, double level = 0.95, std::uint64_t seed = 1,
                        int draws = 10000);

}  // namespace pade::evaluation
