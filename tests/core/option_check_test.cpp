#include "pade/core/option_check.hpp"

#include <array>
#include <limits>

#include <gtest/gtest.h>

namespace pade {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Status of(double value, double least, double most) {
  const std::array ranges = {OptionRange{"x", value, least, most}};
  return check_ranges(ranges);
}

TEST(OptionRange, HoldsItsEndsAndNothingBeyond) {
  EXPECT_TRUE(of(0, 0, 1));
  EXPECT_TRUE(of(1, 0, 1));
  EXPECT_FALSE(of(-1e-9, 0, 1));
  EXPECT_FALSE(of(1 + 1e-9, 0, 1));
  EXPECT_FALSE(of(0, above_zero, 1));
  EXPECT_TRUE(of(1e-300, above_zero, 1));
}

TEST(OptionRange, HoldsInfinityOnlyWhereItIsMeantAndNeverNan) {
  EXPECT_TRUE(of(kInfinity, 0, kInfinity));
  EXPECT_FALSE(of(kInfinity, 0, finite));
  EXPECT_FALSE(of(kNan, -kInfinity, kInfinity));
}

TEST(OptionRange, ARefusalNamesOptionValueAndRange) {
  EXPECT_EQ(of(3, 0, 1).error().message, "option x is 3, expected 0 to 1");
  EXPECT_EQ(of(-1, above_zero, finite).error().message, "option x is -1, expected above 0");
  EXPECT_EQ(within("a", within("b", of(3, 0, 1))).error().message, "option a.b.x is 3, expected 0 to 1");
  EXPECT_TRUE(within("a", of(1, 0, 1)));
}

}  // namespace
}  // namespace pade
