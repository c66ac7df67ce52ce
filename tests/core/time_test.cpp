#include "pade/core/time.hpp"

#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace pade {
namespace {

TEST(Time, DecimalTextSurvivesTheRoundTripToTheNanosecond) {
  for (const char* text :
       {"0.000000", "1305031102.175304", "5000.200000", "-1.500000", "1700000000.123456789"}) {
    const auto time = parse_time(text);
    ASSERT_TRUE(time) << text;
    EXPECT_EQ(to_string(*time), text);
  }
}

TEST(Time, TextWithoutAPointOrWithAnExponentIsUnderstood) {
  EXPECT_EQ(parse_time("12")->nanoseconds, 12'000'000'000);
  EXPECT_EQ(parse_time("1.5e3")->nanoseconds, 1'500'000'000'000);
  EXPECT_EQ(parse_time("0.1234567899")->nanoseconds, 123'456'789);
}

TEST(Time, TextThatIsNotAFiniteNumberIsRefused) {
  for (const char* text : {"", " 1", "1 ", "nan", "inf", "1.2.3", "abc", "1e300", "99999999999", "--1"}) {
    EXPECT_FALSE(parse_time(text)) << text;
  }
}

TEST(Time, TheExtremesPrintWithoutOverflow) {
  EXPECT_EQ(to_string({std::numeric_limits<std::int64_t>::min()}), "-9223372036.854775808");
}

}  // namespace
}  // namespace pade
