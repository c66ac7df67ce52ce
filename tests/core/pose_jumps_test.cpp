// Which poses follow from those before, for poses at every rate.
#include "pade/core/sensors/pose_jumps.hpp"

#include <cmath>
#include <cstdint>
#include <deque>

#include <gtest/gtest.h>

namespace pade {
namespace {

struct Sample {
  Time time;
  Pose pose;
};

Time at(double seconds) { return {1'000'000'000'000 + static_cast<std::int64_t>(seconds * 1e9)}; }

Pose pose(double x, double y, double yaw = 0) {
  Pose out;
  out.translation = {x, y, 2};
  out.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  return out;
}

/// Four seconds at 3 m/s, turning by 0.5 rad/s.
std::deque<Sample> flown(double period) {
  std::deque<Sample> out;
  for (double t = 0; t < 4; t += period) out.push_back({at(t), pose(3 * t, 0, 0.5 * t)});
  return out;
}

double end(const std::deque<Sample>& samples) { return seconds_between(at(0), samples.back().time); }

TEST(PoseJumps, AVehicleThatBrakesTurnsAndSpeedsUpMakesNone) {
  for (const double period : {0.005, 0.02, 0.033, 0.1, 0.2}) {
    std::deque<Sample> samples;
    double x = 0, v = 0, yaw = 0, rate = 0;
    constexpr double kStep = 1e-3;
    double due = 0;
    for (double t = 0; t < 10; t += kStep) {
      // Braking by 12 m/s², yaw rates of 2 rad/s reached in 0.2 s, roll of 2 Hz and 0.3 rad.
      v += kStep * (std::fmod(t, 2) < 1 ? 12 : -12);
      rate = std::clamp(rate + kStep * (std::fmod(t, 3) < 1.5 ? 10 : -10), -2.0, 2.0);
      x += kStep * v;
      yaw += kStep * rate;
      if (t < due) continue;
      due += period;
      Pose now = pose(x, 0, yaw);
      now.rotation = now.rotation * Eigen::AngleAxisd(0.3 * std::sin(4 * M_PI * t), Eigen::Vector3d::UnitX());
      EXPECT_FALSE(jump_to(samples, at(t), now)) << period << " at " << t;
      samples.push_back({at(t), now});
    }
  }
}

TEST(PoseJumps, APlaceOrAHeadingThatIsSetAnewIsOneAtEveryRateAndOverGaps) {
  for (const double period : {0.005, 0.033, 0.1}) {
    const auto samples = flown(period);
    for (const double gap : {period, 0.2, 0.3, 0.6, 1.0}) {
      const double t = end(samples) + gap;
      const auto ahead = pose(3 * t, 0, 0.5 * t);
      EXPECT_FALSE(jump_to(samples, at(t), ahead)) << period << " " << gap;
      const auto aside = jump_to(samples, at(t), pose(3 * t, 5, 0.5 * t));
      ASSERT_TRUE(aside) << period << " " << gap;
      EXPECT_EQ(aside->kind, PoseJump::Kind::place);
      EXPECT_NEAR(aside->size, 5, 0.01);
    }
    const double next = end(samples) + period;
    const auto turned = jump_to(samples, at(next), pose(3 * next, 0, 0.5 * next + 40 * M_PI / 180));
    ASSERT_TRUE(turned) << period;
    EXPECT_EQ(turned->kind, PoseJump::Kind::turn);
    EXPECT_NEAR(turned->size, 40 * M_PI / 180, 0.01);
    const auto opposite = jump_to(samples, at(next + 0.6), pose(3 * (next + 0.6), 0, 0.5 * next + M_PI));
    EXPECT_TRUE(opposite) << period;
  }
}

TEST(PoseJumps, NothingLeadsOverMoreThanTwoSeconds) {
  const auto samples = flown(0.05);
  const auto gap = jump_to(samples, at(end(samples) + 5), samples.back().pose);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->kind, PoseJump::Kind::gap);
  EXPECT_NEAR(gap->size, 5, 1e-6);
}

/// A driver that stamps at arrival: messages of 200 Hz come two by two.
TEST(PoseJumps, StampsAtArrivalInBurstsMakeNone) {
  for (const int burst : {2, 4, 8}) {
    for (const double speed : {2.0, 10.0}) {
      std::deque<Sample> samples;
      for (int i = 0; i < 2000; ++i) {
        const double t = 0.005 * (i - i % burst + burst) - 1e-4 * (burst - 1 - i % burst);
        const Pose now = pose(speed * 0.005 * i, 0, 0.5 * 0.005 * i);
        ASSERT_FALSE(jump_to(samples, at(t), now)) << burst << " " << speed << " " << i;
        samples.push_back({at(t), now});
      }
    }
  }
}

TEST(PoseJumps, ThatAreNoNumbersNeverFollow) {
  const auto samples = flown(0.05);
  EXPECT_TRUE(jump_to(samples, at(end(samples) + 0.05), pose(NAN, 0)));
  EXPECT_FALSE(jump_to(std::deque<Sample>{}, at(0), pose(1, 1)));
}

}  // namespace
}  // namespace pade
