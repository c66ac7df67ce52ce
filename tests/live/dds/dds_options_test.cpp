// Names, domains, clocks: what needs no network.
#include "pade/live/dds/dds_options.hpp"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/live/dds/message_clock.hpp"
#include "pade/live/dds/network.hpp"

#include "live/dds/still_clocks.hpp"

namespace pade::live {
namespace {

using testing::HasSubstr;

TEST(DdsOptions, RefusesNamesThatRosDoesNotHave) {
  DdsOptions options;
  EXPECT_TRUE(check(options).ok());
  for (const char* const name : {"odom", "", "/", "/a//b", "/1a", "/a-b", "/a/", "/a b"}) {
    options.poses = name;
    const Status status = check(options);
    ASSERT_FALSE(status.ok()) << name;
    EXPECT_THAT(status.error().message, HasSubstr("dds.poses")) << name;
  }
  options.poses = "/mavros/local_position/odom2";
  EXPECT_TRUE(check(options).ok());
  options.name_space = "/uav1";
  EXPECT_THAT(check(options).error().message, HasSubstr("dds.namespace"));
  options.name_space = "fleet/uav1";
  EXPECT_TRUE(check(options).ok());
  options.domain = 233;
  EXPECT_THAT(check(options).error().message, HasSubstr("dds.domain"));
}

TEST(DdsOptions, TheDomainIsTheirsOrThatOfTheEnvironment) {
  DdsOptions options;
  ::unsetenv("ROS_DOMAIN_ID");
  EXPECT_EQ(*domain_of(options), 0);
  ::setenv("ROS_DOMAIN_ID", "42", 1);
  EXPECT_EQ(*domain_of(options), 42);
  options.domain = 3;
  EXPECT_EQ(*domain_of(options), 3);
  options.domain = -1;
  ::setenv("ROS_DOMAIN_ID", "forty", 1);
  ASSERT_FALSE(domain_of(options).ok());
  EXPECT_THAT(domain_of(options).error().message, HasSubstr("ROS_DOMAIN_ID: found \"forty\""));
  ::unsetenv("ROS_DOMAIN_ID");
}

TEST(DdsOptions, NamesAreThoseOnTheWire) {
  EXPECT_EQ(dds_type_name("sensor_msgs/Image"), "sensor_msgs::msg::dds_::Image_");
  EXPECT_EQ(ros_type_name("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/Image");
  EXPECT_EQ(ros_type_name("Chatter"), "Chatter");
  DdsOptions options;
  EXPECT_EQ(own_topic(options, "/pade/cloud"), "/pade/cloud");
  options.name_space = "uav1";
  EXPECT_EQ(own_topic(options, "/pade/cloud"), "/uav1/pade/cloud");
}

TEST(MessageClock, ThereAndBackIsTheSameStampAlsoWhenTheSystemsClockIsSet) {
  std::int64_t set = 0;
  MessageClock clock(StampClock::system,
                     {[] { return kStillOurs; }, [&] { return Time{kStillSystem.nanoseconds + set}; }});
  for (const std::int64_t by : {0, 500'000, 30'000'000}) {  // ns
    set = by;
    const Time stamp{kStillSystem.nanoseconds + by - 123'456'789};
    const auto ours = clock.to_ours(stamp);
    ASSERT_TRUE(ours.has_value());
    EXPECT_EQ(clock.to_stamp(*ours).nanoseconds, stamp.nanoseconds);
    EXPECT_NEAR(seconds_between(*ours, kStillOurs), 0.123456789, 1e-3);
  }
  EXPECT_EQ(clock.restarts(), 1U) << "half a millisecond is what two readings differ by";
}

TEST(MessageClock, StampsOfAnotherClockAreRefusedUnlessARecordingIsPlayed) {
  std::int64_t moved = 0;
  const Time first{1'500'000'000'000'000'000};
  MessageClock system(StampClock::system, still_clocks(moved));
  EXPECT_FALSE(system.to_ours(first).has_value());
  EXPECT_FALSE(system.to_ours({kStillSystem.nanoseconds - 1'100'000'000}).has_value());
  EXPECT_TRUE(system.to_ours({kStillSystem.nanoseconds - 900'000'000}).has_value());
  MessageClock played(StampClock::played, still_clocks(moved));
  const auto a = played.to_ours(first);
  moved = 100'000'000;
  const auto b = played.to_ours({first.nanoseconds + moved});
  ASSERT_TRUE(a && b);
  EXPECT_LE(*a, kStillOurs);
  EXPECT_EQ(b->nanoseconds - a->nanoseconds, moved);
  EXPECT_EQ(played.to_stamp(*a).nanoseconds, first.nanoseconds);
  EXPECT_EQ(played.restarts(), 0U);
  ASSERT_TRUE(played.to_ours({first.nanoseconds - 60'000'000'000}).has_value());
  EXPECT_EQ(played.restarts(), 1U) << "it begins anew";
}

TEST(MessageClock, ARecordingMayBePlayedAtAnyPaceAndPause) {
  constexpr std::int64_t kPeriod = 50'000'000, kMinute = 60'000'000'000;
  for (const double pace : {0.1, 0.5, 0.8, 1.0, 2.0, 10.0}) {
    std::int64_t moved = 0;
    MessageClock clock(StampClock::played, still_clocks(moved));
    const Time first{1'500'000'000'000'000'000};
    const auto begun = clock.to_ours(first);
    ASSERT_TRUE(begun);
    for (std::int64_t told = kPeriod; told < kMinute; told += kPeriod) {
      moved = static_cast<std::int64_t>(static_cast<double>(told) / pace);
      const auto ours = clock.to_ours({first.nanoseconds + told});
      ASSERT_TRUE(ours);
      ASSERT_EQ(ours->nanoseconds - begun->nanoseconds, told) << "as it tells them, at pace " << pace;
      ASSERT_EQ(clock.to_stamp(*ours).nanoseconds, first.nanoseconds + told);
      // By what the newest lies behind, no more and no less than on its way: 30 ms and a tenth of a second.
      ASSERT_NEAR(seconds_between(*ours, clock.now()) - clock.behind(), 0.03, 0.1) << pace;
    }
    EXPECT_EQ(clock.restarts(), 0U) << pace;
    moved += 3'000'000'000;  // a pause
    ASSERT_TRUE(clock.to_ours({first.nanoseconds + kMinute}));
    EXPECT_EQ(clock.restarts(), 0U) << pace;
    ASSERT_TRUE(clock.to_ours({first.nanoseconds + 2 * kMinute}));
    EXPECT_EQ(clock.restarts(), 1U) << "somebody went on to another place of it, at pace " << pace;
    const auto now = clock.to_ours({first.nanoseconds});
    ASSERT_TRUE(now);
    EXPECT_EQ(clock.restarts(), 2U) << "it begins anew, at pace " << pace;
    EXPECT_NEAR(seconds_between(*now, clock.now()), 0.03, 1e-6);
  }
}

}  // namespace
}  // namespace pade::live
