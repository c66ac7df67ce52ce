// Frames that arrive as they may, and the times that the clock gives them.
#include "pade/live/camera/video_clock.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace pade::live {
namespace {

/// Delays of 40 ms and an exponential jitter of 15 ms: the stamps are late by the least delay, to within the
/// jitter's share, and evenly spaced.
TEST(VideoClock, TheLeastDelayIsTheClock) {
  for (const double drift : {-5e-5, 0.0, 5e-5}) {
    std::mt19937 random(3);
    std::exponential_distribution<double> jitter(1 / 0.015);
    VideoClock clock;
    int given = 0;
    double worst = 0;
    for (int i = 0; i < 60 * 25; ++i) {
      const double exposure = 1e6 + i / 25.0;
      const double arrived = exposure + 0.04 + jitter(random);
      const auto time = clock.time_of(i / 25.0 * (1 + drift) + 77, Time::from_seconds(arrived));
      if (!time) continue;
      ++given;
      EXPECT_LE(time->seconds(), arrived + 1e-6);
      if (i > 250) worst = std::max(worst, std::abs(time->seconds() - exposure - 0.04));
    }
    EXPECT_GE(given, 60 * 25 - 27);
    EXPECT_LT(worst, 0.006) << drift;
  }
}

TEST(VideoClock, AStampThatJumpsBeginsAnew) {
  VideoClock clock;
  const auto at = [&](double stamp, double arrived) {
    return clock.time_of(stamp, Time::from_seconds(arrived));
  };
  for (int i = 0; i < 50; ++i) at(i / 25.0, 100 + i / 25.0);
  ASSERT_TRUE(at(2, 102));
  EXPECT_FALSE(at(500, 102.04));
  for (int i = 1; i < 30; ++i) at(500 + i / 25.0, 102.04 + i / 25.0);
  const auto time = at(501.2, 103.24);
  ASSERT_TRUE(time);
  EXPECT_NEAR(time->seconds(), 103.24, 1e-3);
}

/// Every fifth frame has the stamp of the one before, as some senders repeat them: it is left out, and no
/// more.
TEST(VideoClock, RepeatedStampsCostTheirFramesAlone) {
  VideoClock clock;
  int given = 0;
  for (int i = 0; i < 200; ++i) {
    const double stamp = (i % 5 == 4 ? i - 1 : i) / 20.0;
    const auto time = clock.time_of(50 + stamp, Time::from_seconds(1000 + i / 20.0 + 0.04));
    if (!time) continue;
    ++given;
    EXPECT_NEAR(time->seconds(), 1000 + stamp + 0.04, 1e-6);
  }
  EXPECT_GE(given, 200 * 4 / 5 - 11);
}

/// A sender that counts its nominal rate while it makes fewer frames: its clock is found again and again.
TEST(VideoClock, AClockThatDoesNotKeepUpIsFoundAgain) {
  VideoClock clock;
  double worst = 0;
  int given = 0;
  for (int i = 0; i < 1200; ++i) {
    const double arrived = 1000 + i / 16.0;
    const auto time = clock.time_of(i / 20.0, Time::from_seconds(arrived));
    if (!time) continue;
    ++given;
    worst = std::max(worst, arrived - time->seconds());
  }
  EXPECT_GT(given, 1000);
  EXPECT_GT(worst, 1);
  EXPECT_LT(worst, 3.5) << "1 s until it counts as late, and a fifth of ten seconds";
}

/// When frames arrive that are taken ten times a second, over a link that takes some time for each.
class Link {
 public:
  double arrival(double sent, double time_of_a_frame) {
    free_ = std::max(free_, sent) + time_of_a_frame;
    return free_ + 0.04;
  }

 private:
  double free_ = 0;
};

/// Two thirds of the frames' rate from 4 s to 8 s: the queue grows until frames come more than a second late,
/// and is worked off afterwards.
TEST(VideoClock, FramesThatCongestionHoldsUpKeepTheirTimes) {
  VideoClock clock;
  Link link;
  double latest = 0;
  int given = 0;
  for (int i = 0; i < 300; ++i) {
    const double exposure = 1000 + 0.1 * i;
    const bool congested = exposure > 1004 && exposure < 1008;
    const double arrived = link.arrival(exposure, congested ? 0.15 : 0.02);
    latest = std::max(latest, arrived - exposure);
    const auto time = clock.time_of(0.1 * i + 77, Time::from_seconds(arrived));
    if (!time) continue;
    ++given;
    EXPECT_NEAR(time->seconds(), exposure + 0.06, 0.005) << i;
  }
  EXPECT_GT(latest, 1.5);
  EXPECT_GE(given, 300 - 6);
}

/// Forward or back, by little or much, while frames come and after the link has been silent.
TEST(VideoClock, ASendersClockThatIsSetIsFollowed) {
  for (const double step : {-3600.0, -5.0, -0.3, 0.3, 5.0, 3600.0}) {
    for (const double silence : {0.0, 0.15}) {
      VideoClock clock;
      for (int i = 0; i < 200; ++i) {
        const bool set = i >= 100;
        const double exposure = 1000 + 0.1 * i + (set ? silence : 0);
        const auto time = clock.time_of(exposure + (set ? step : 0), Time::from_seconds(exposure + 0.05));
        const bool settling = i < 6 || (set && i < 106);
        EXPECT_TRUE(time || settling) << step << " " << i;
        EXPECT_NEAR(time ? time->seconds() : exposure + 0.05, exposure + 0.05, 0.005) << step << " " << i;
      }
    }
  }
}

/// A connection that hangs for three seconds while its sender leaves frames out: the stamps go on by three
/// seconds at once when it is free again, and nobody's clock was set.
TEST(VideoClock, AGapIsNoJump) {
  VideoClock clock;
  int given = 0;
  for (int i = 0; i < 200; ++i) {
    if (i > 100 && i < 130) continue;
    const double exposure = 1000 + 0.1 * i;
    const double late = i == 100 ? 3 : 0;
    const auto time = clock.time_of(exposure, Time::from_seconds(exposure + 0.05 + late));
    if (!time) continue;
    ++given;
    EXPECT_NEAR(time->seconds(), exposure + 0.05, 0.005) << i;
  }
  EXPECT_GE(given, 200 - 29 - 6);
}

}  // namespace
}  // namespace pade::live
