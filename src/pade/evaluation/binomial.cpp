#include "pade/evaluation/binomial.hpp"

#include <cmath>

namespace pade::evaluation {
namespace {

/// P(X <= k) of n trials with success rate p.
double at_most(std::size_t k, std::size_t n, double p) {
  if (k >= n) return 1;
  if (p >= 1) return 0;
  if (p <= 0) return 1;
  const auto size = static_cast<double>(n);
  double sum = 0;
  for (std::size_t i = 0; i <= k; ++i) {
    const auto hits = static_cast<double>(i);
    sum += std::exp(std::lgamma(size + 1) - std::lgamma(hits + 1) - std::lgamma(size - hits + 1) +
                    hits * std::log(p) + (size - hits) * std::log1p(-p));
  }
  return sum;
}

/// Where a falling function of the rate is `value`.
template <class Function>
double solve(const Function& falling, double value) {
  constexpr int kHalvings = 60;
  double low = 0;
  double high = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (falling(middle) > value ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

RateInterval clopper_pearson(std::size_t successes, std::size_t trials, double confidence) {
  RateInterval interval;
  const double tail = 0.5 * (1 - confidence);
  if (successes > 0)
    interval.low = solve([&](double p) { return at_most(successes - 1, trials, p); }, 1 - tail);
  if (successes < trials)
    interval.high = solve([&](double p) { return at_most(successes, trials, p); }, tail);
  return interval;
}

}  // namespace pade::evaluation
