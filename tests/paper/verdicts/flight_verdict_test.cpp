// The verdict on autonomous flight: from what `pade experiment fly` writes.
#include "pade/paper/verdicts/flight_verdict.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

using testing::HasSubstr;

Verdict of(std::vector<FlownFlights> flights) { return judge_flights(flights); }
const FlownFlights kStraight{"straight", 100, 7, 93};

TEST(FlightVerdict, NeedsOurChainAndTheBlindBesideIt) {
  EXPECT_EQ(of({}).outcome, Outcome::not_tested);
  EXPECT_EQ(of({{"chain", 100, 100, 0}}).outcome, Outcome::not_tested);
  EXPECT_EQ(of({kStraight}).outcome, Outcome::not_tested);
  EXPECT_EQ(of({{"chain", 0, 0, 0}, kStraight}).outcome, Outcome::not_tested);
  EXPECT_EQ(of({{"chain", 100, 100, 0}, kStraight}).outcome, Outcome::in_part);
}

/// Exact intervals at 95 %: none of 100 is 0 to 3.62 %, one 0.03 to 5.45, two 0.24 to 7.04; none of 20 is 0
/// to 16.84.
TEST(FlightVerdict, IsOfTheIntervalAndNotOfTheRate) {
  const Verdict none = of({{"chain", 100, 97, 0}, kStraight});
  EXPECT_EQ(none.interval.estimate, 0);
  EXPECT_NEAR(none.interval.high, 0.0362, 5e-5);
  EXPECT_EQ(none.interval.count, 100);
  EXPECT_THAT(none.sense, HasSubstr("of 100 flights 97 (91.5 to 99.4 %) arrived, 0 (0.0 to 3.6 %) collided"));
  EXPECT_EQ(of({{"chain", 100, 99, 1}, kStraight}).outcome, Outcome::does_not);
  EXPECT_EQ(of({{"chain", 20, 20, 0}, kStraight}).outcome, Outcome::does_not) << "too few to say so";
}

TEST(FlightVerdict, AsksForTheBlindToBeWorse) {
  const FlownFlights chain{"chain", 100, 95, 0};
  EXPECT_EQ(of({chain, {"straight", 100, 80, 20}}).outcome, Outcome::in_part);
  EXPECT_EQ(of({chain, {"straight", 100, 90, 10}}).outcome, Outcome::does_not)
      << "worlds that ask for nothing";
}

TEST(FlightVerdict, ReproducesWithThePapersDepthAlone) {
  const FlownFlights chain{"chain", 100, 100, 0};
  EXPECT_EQ(of({chain, kStraight, {"pade", 100, 98, 0}}).outcome, Outcome::reproduces);
  EXPECT_EQ(of({chain, kStraight, {"pade", 20, 2, 15}}).outcome, Outcome::in_part);
  EXPECT_THAT(of({chain, kStraight, {"pade", 20, 2, 15}}).sense, HasSubstr("of 20 flights 2"));
  EXPECT_THAT(of({chain, kStraight}).sense, HasSubstr("was not flown"));
}

TEST(FlightVerdict, ReadsTheGridAndGoesThroughAPlan) {
  const std::string grid =
      R"([{"configuration":"chain","world":"forest","totals":{"flights":40,"arrived":{"flights":39},"collided":{"flights":1}}},
          {"configuration":"chain","world":"all","totals":{"flights":100,"arrived":{"flights":98},"collided":{"flights":1}}},
          {"configuration":"straight","world":"all","totals":{"flights":100,"arrived":{"flights":9},"collided":{"flights":91}}},
          {"configuration":"density-200","world":"forest","totals":{"flights":20,"arrived":{"flights":20},"collided":{"flights":0}}}])";
  const auto read = flights_of_grid(grid, "grid.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const std::vector<FlownFlights> flights{
      {"chain", 100, 98, 1}, {"straight", 100, 9, 91}, {"density-200", 20, 20, 0}};
  EXPECT_EQ(*read, flights);
  EXPECT_EQ(text_of(flights), "chain:100:98:1,straight:100:9:91,density-200:20:20:0");
  EXPECT_EQ(flights_from_text(text_of(flights)).value(), flights);
  EXPECT_TRUE(flights_from_text("").value().empty());
}

TEST(FlightVerdict, RefusesWhatIsNoGrid) {
  for (const char* json : {"", "[1]", "{}x", R"([{"configuration":"chain"}])"})
    EXPECT_THAT(
        flights_of_grid(json, "some.json").ok() ? "" : flights_of_grid(json, "some.json").error().message,
        HasSubstr("some.json"))
        << json;
  const auto more = flights_of_grid(
      R"([{"configuration":"chain","world":"all","totals":{"flights":3,"arrived":{"flights":3},"collided":{"flights":1}}}])",
      "some.json");
  ASSERT_FALSE(more.ok());
  EXPECT_THAT(more.error().message, HasSubstr("found 3 arrived and 1 collided of 3 flights"));
  const auto wrapped = flights_of_grid(
      R"([{"configuration":"chain","world":"all","totals":{"flights":3,"arrived":{"flights":-1},"collided":{"flights":1}}}])",
      "some.json");
  ASSERT_FALSE(wrapped.ok());
  EXPECT_THAT(wrapped.error().message, HasSubstr("counts that fit together"));
  EXPECT_THAT(flights_of_grid("[]", "some.json").error().message, HasSubstr("found flights of nothing"));
  for (const char* text :
       {"chain", "chain:1:1", "chain:1:1:1", ":1:1:0", "chain:1:x:0", "chain:3:1:1:", "chain:-1:0:0"})
    EXPECT_FALSE(flights_from_text(text).ok()) << text;
}

}  // namespace
}  // namespace pade::evaluation
