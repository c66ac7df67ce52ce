// The interval holds the true mean as often as it says.
#include "pade/evaluation/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::evaluation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// How often the interval of `count` values holds their expectation, and misses it on either side.
struct Coverage {
  double inside = 0, too_high = 0, too_low = 0;
};

Coverage coverage(int count, double level, double expectation, const std::function<double(Random&)>& draw) {
  constexpr int kTrials = 2000;
  Random random(7);
  Coverage found;
  std::vector<double> values(static_cast<std::size_t>(count));
  for (int trial = 0; trial < kTrials; ++trial) {
    std::generate(values.begin(), values.end(), [&] { return draw(random); });
    const Interval interval = bootstrap_mean(values, level, static_cast<std::uint64_t>(trial), 1000);
    if (interval.above(expectation))
      found.too_high += 1.0 / kTrials;
    else if (interval.below(expectation))
      found.too_low += 1.0 / kTrials;
    else
      found.inside += 1.0 / kTrials;
  }
  return found;
}

double normal(Random& random) { return 3 + 2 * random.normal(); }
double skewed(Random& random) { return std::exp(0.6 * random.normal()); }  // log-normal
const double kSkewedMean = std::exp(0.5 * 0.6 * 0.6);

TEST(Bootstrap, NinetyFivePercentOfIntervalsOfTenNormalValuesHoldTheMean) {
  const Coverage found = coverage(10, 0.95, 3, normal);
  EXPECT_NEAR(found.inside, 0.95, 0.02);
  EXPECT_NEAR(found.too_high, found.too_low, 0.02);
}

TEST(Bootstrap, TheLevelIsKept) { EXPECT_NEAR(coverage(12, 0.8, 3, normal).inside, 0.8, 0.03); }

TEST(Bootstrap, SkewedValuesAreHeldNearlyAsOften) {
  EXPECT_NEAR(coverage(10, 0.95, kSkewedMean, skewed).inside, 0.95, 0.045);
  EXPECT_NEAR(coverage(40, 0.95, kSkewedMean, skewed).inside, 0.95, 0.025);
}

TEST(Bootstrap, ALongTailMovesTheIntervalTowardIt) {
  Random random(3);
  std::vector<double> values(30);
  std::generate(values.begin(), values.end(), [&] { return std::exp(1.2 * random.normal()); });
  const Interval interval = bootstrap_mean(values);
  EXPECT_GT(interval.high - interval.estimate, 1.2 * (interval.estimate - interval.low));
}

TEST(Bootstrap, ManyNormalValuesGiveTheIntervalOfTheTextbook) {
  Random random(5);
  std::vector<double> values(400);
  std::generate(values.begin(), values.end(), [&] { return normal(random); });
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / 400;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double half = 1.96 * std::sqrt(squares / 399 / 400);
  const Interval interval = bootstrap_mean(values);
  EXPECT_DOUBLE_EQ(interval.estimate, mean);
  EXPECT_NEAR(interval.low, mean - half, 0.08 * half);
  EXPECT_NEAR(interval.high, mean + half, 0.08 * half);
}

TEST(Bootstrap, ShiftScaleAndSignOfTheValuesAreThoseOfTheInterval) {
  const std::vector<double> values = {0.3, 1.2, -0.4, 2.5, 0.9, 0.1, 0.8};
  std::vector<double> moved = values, mirrored = values;
  for (double& value : moved) value = 4 * value + 8;
  for (double& value : mirrored) value = -value;
  const Interval interval = bootstrap_mean(values);
  const Interval other = bootstrap_mean(moved);
  EXPECT_NEAR(other.low, 4 * interval.low + 8, 1e-9);
  EXPECT_NEAR(other.high, 4 * interval.high + 8, 1e-9);
  EXPECT_NEAR(bootstrap_mean(mirrored).low, -interval.high, 0.02);
  EXPECT_NEAR(bootstrap_mean(mirrored).high, -interval.low, 0.02);
}

TEST(Bootstrap, IsTheSameEachTime) {
  const std::vector<double> values = {1, 2, 4, 8, 16};
  const Interval once = bootstrap_mean(values), again = bootstrap_mean(values);
  EXPECT_EQ(once.low, again.low);
  EXPECT_EQ(once.high, again.high);
  EXPECT_LT(once.low, once.estimate);
  EXPECT_GT(once.high, once.estimate);
}

TEST(Bootstrap, NoValuesHaveNoMeanAndOneHasNoInterval) {
  const Interval none = bootstrap_mean({});
  EXPECT_EQ(none.count, 0);
  EXPECT_TRUE(std::isnan(none.estimate) && std::isnan(none.low) && std::isnan(none.high));
  const std::vector<double> one = {2.5};
  const Interval single = bootstrap_mean(one);
  EXPECT_EQ(single.estimate, 2.5);
  EXPECT_TRUE(std::isnan(single.low) && std::isnan(single.high));
  EXPECT_FALSE(single.above(0) || single.below(0));
}

TEST(Bootstrap, EqualValuesAreSure) {
  const std::vector<double> equal(4, 0.1);
  const Interval interval = bootstrap_mean(equal);
  EXPECT_EQ(interval.low, 0.1);
  EXPECT_EQ(interval.estimate, 0.1);
  EXPECT_EQ(interval.high, 0.1);
}

TEST(Bootstrap, NaNIsLeftOut) {
  const std::vector<double> with = {1, kNaN, 2, 4, kNaN}, without = {1, 2, 4};
  const Interval interval = bootstrap_mean(with);
  EXPECT_EQ(interval.count, 3);
  EXPECT_EQ(interval.low, bootstrap_mean(without).low);
  EXPECT_EQ(interval.high, bootstrap_mean(without).high);
}

}  // namespace
}  // namespace pade::evaluation
