#include "pade/evaluation/binomial.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

/// P(X >= k) by adding the recursion of the terms up.
double at_least(int k, int n, double p) {
  double term = std::pow(1 - p, n);
  double below = 0;
  for (int i = 0; i < k; ++i) {
    below += term;
    term *= (n - i) / (i + 1.0) * p / (1 - p);
  }
  return 1 - below;
}

/// The ends are where either tail has 2.5 %.
TEST(ClopperPearson, TheEndsLeaveATailEach) {
  for (const int n : {1, 5, 20, 100}) {
    for (int k = 0; k <= n; k += std::max(1, n / 7)) {
      const RateInterval i = clopper_pearson(static_cast<std::size_t>(k), static_cast<std::size_t>(n), 0.95);
      EXPECT_LE(i.low, static_cast<double>(k) / n);
      EXPECT_GE(i.high, static_cast<double>(k) / n);
      if (k > 0) {
        EXPECT_NEAR(at_least(k, n, i.low), 0.025, 1e-6);
      }
      if (k < n) {
        EXPECT_NEAR(1 - at_least(k + 1, n, i.high), 0.025, 1e-6);
      }
    }
  }
}

/// In closed form where all or none succeed.
TEST(ClopperPearson, NoneAndAll) {
  const RateInterval none = clopper_pearson(0, 100, 0.95);
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 1 - std::pow(0.025, 0.01), 1e-9);
  const RateInterval all = clopper_pearson(100, 100, 0.95);
  EXPECT_NEAR(all.low, std::pow(0.025, 0.01), 1e-9);
  EXPECT_EQ(all.high, 1);
  const RateInterval nothing = clopper_pearson(0, 0, 0.95);
  EXPECT_EQ(nothing.low, 0);
  EXPECT_EQ(nothing.high, 1);
}

}  // namespace
}  // namespace pade::evaluation
