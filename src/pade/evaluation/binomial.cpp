#include "pade/evaluation/binomial.hpp"

#include <boost/math/distributions/binomial.hpp>

namespace pade::evaluation {

RateInterval clopper_pearson(std::size_t successes, std::size_t trials, double confidence) {
  using boost::math::binomial;
  RateInterval interval;
  if (trials == 0) return interval;
  const auto n = static_cast<double>(trials);
  const auto k = static_cast<double>(successes);
  const double tail = 0.5 * (1 - confidence);
  interval.low = binomial::find_lower_bound_on_p(n, k, tail);
  interval.high = binomial::find_upper_bound_on_p(n, k, tail);
  return interval;
}

}  // namespace pade::evaluation
