// The middle value, however the values lie.
#include "pade/core/compute/median.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade {
namespace {

TEST(Median, IsTheUpperMiddleOfTheSortedValuesInWhateverOrderTheyCome) {
  Random random(5);
  for (std::size_t count = 1; count < 40; ++count) {
    std::vector<double> values(count);
    for (double& value : values) value = std::floor(20 * random.uniform());
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median(values), sorted[count / 2]);
  }
}

TEST(Median, OfNothingIsWhatTheCallerSays) {
  EXPECT_TRUE(std::isnan(median(std::vector<double>())));
  EXPECT_EQ(median(std::vector<double>(), 7.0), 7);
  EXPECT_EQ(median(std::vector<float>{3, 1, 2}), 2.0F);
}

}  // namespace
}  // namespace pade
