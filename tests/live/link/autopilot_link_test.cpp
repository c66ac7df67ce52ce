// The talk with a simulated autopilot, in simulated time.
#include "pade/live/link/autopilot_link.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "live/link/link_bench.hpp"

namespace pade::live {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(AutopilotLink, SaysNothingBeforeItHasHeardTheAutopilot) {
  Bench bench;
  bench.heartbeat = false;
  bench.run(3);
  EXPECT_EQ(bench.packets, 0U);
  EXPECT_FALSE(bench.link().report().autopilot);
}

TEST(AutopilotLink, TakesTheSystemOfTheAutopilotAndAnswersItsQuestions) {
  Bench bench;
  bench.questions = true;
  bench.run(4);
  ASSERT_GT(bench.packets, 0U);
  for (const std::uint8_t system : bench.systems) EXPECT_EQ(system, 7);
  ASSERT_GT(bench.answered.size(), 25U);
  EXPECT_EQ(bench.answered.front() % 1000, bench.now().nanoseconds / kMillisecond % 1000 + 50);
  EXPECT_EQ(bench.link().report().autopilot->system, 7);
}

TEST(AutopilotLink, GivesPosesByOurClockWithin3Seconds) {
  Bench bench;
  bench.run(3);
  ASSERT_TRUE(bench.link().report().synchronised);
  const Time asked{bench.now().nanoseconds - 100 * kMillisecond};
  const PoseAnswer answer = bench.link().pose_at(asked);
  ASSERT_EQ(answer.kind, PoseAnswer::Kind::valid);
  const double boot = static_cast<double>(asked.nanoseconds) * 1e-9 - 1000;
  // The answers to our questions wait for the next step: half of 10 ms at 2 m/s.
  EXPECT_NEAR(answer.T_world_body.translation.y(), 2 * boot, 0.011);
  EXPECT_NEAR(answer.T_world_body.translation.z(), 5, 1e-6);
  EXPECT_EQ(bench.link().pose_at({bench.now().nanoseconds + 100 * kMillisecond}).kind,
            PoseAnswer::Kind::not_yet);
}

TEST(AutopilotLink, AsksForPosesUntilTheyCome) {
  Bench bench;
  bench.poses = false;
  bench.ack = 4;  // MAV_RESULT_FAILED
  bench.run(5);
  const std::size_t asked = bench.commands.size();
  ASSERT_GE(asked, 4U);
  EXPECT_EQ(bench.commands[0].command, 511);
  EXPECT_EQ(bench.commands[0].param1, 31);
  EXPECT_EQ(bench.commands[1].param1, 32);
  EXPECT_NEAR(bench.commands[0].param2, 33333, 1);
  EXPECT_THAT(bench.link().report().refused, HasSubstr("511 (result 4)"));
  bench.poses = true;
  bench.run(4);
  const std::size_t then = bench.commands.size();
  bench.run(10);
  EXPECT_EQ(bench.commands.size(), then);
}

TEST(AutopilotLink, IsActiveOnceAllIsThereWithAHeartbeatEachSecond) {
  Bench bench;
  bench.run(5);
  EXPECT_EQ(bench.link().report().missing, Missing::nothing);
  bench.heartbeats.clear();
  bench.run(10);
  EXPECT_EQ(bench.heartbeats.size(), 10U);
  for (const auto& said : bench.heartbeats) EXPECT_EQ(said.state, kActiveState);
  EXPECT_THAT(bench.texts.back().second, StartsWith("PADE: obstacle mapping active"));
}

/// Turns an input off and on, and expects that to be said in time.
void expect_said(bool Bench::*input, const std::string& text) {
  Bench bench;
  bench.run(5);
  ASSERT_EQ(bench.link().report().missing, Missing::nothing);
  bench.*input = false;
  const Time off = bench.now();
  bench.run(3);
  const auto silent = std::find_if(bench.heartbeats.begin(), bench.heartbeats.end(),
                                   [&](const auto& h) { return h.time > off && h.state != kActiveState; });
  ASSERT_NE(silent, bench.heartbeats.end());
  EXPECT_LE(seconds_between(off, silent->time), 0.5);
  EXPECT_THAT(bench.texts.back().second, HasSubstr(text));
  EXPECT_LE(seconds_between(off, bench.texts.back().first), 0.5);
  bench.*input = true;
  const Time on = bench.now();
  bench.run(2);
  const auto back = std::find_if(bench.heartbeats.begin(), bench.heartbeats.end(),
                                 [&](const auto& h) { return h.time > on && h.state == kActiveState; });
  ASSERT_NE(back, bench.heartbeats.end());
  EXPECT_LE(seconds_between(on, back->time), 1);
}

TEST(AutopilotLink, NamesACameraThatStalls) { expect_said(&Bench::camera, "no image from the camera"); }
TEST(AutopilotLink, NamesPosesThatStopComing) { expect_said(&Bench::poses, "no pose from the autopilot"); }
TEST(AutopilotLink, NamesAMapperThatIsBlocked) { expect_said(&Bench::mapper, "the mapper does not get on"); }
TEST(AutopilotLink, NamesHoverWhereThereIsNoDepth) { expect_said(&Bench::depth, "no parallax (hover?)"); }

TEST(AutopilotLink, SectorsAreSentOnceAndNeverOld) {
  Bench bench;
  bench.run(5);
  bench.link().offer(with(mavlink::ObstacleDistance{}), {bench.now().nanoseconds - 100 * kMillisecond});
  bench.run(1);
  EXPECT_EQ(bench.sectors.size(), 1U);
  bench.link().offer(with(mavlink::ObstacleDistance{}), {bench.now().nanoseconds - 350 * kMillisecond});
  bench.run(1);
  EXPECT_EQ(bench.sectors.size(), 1U);
  EXPECT_EQ(bench.link().report().sectors_stale, 1U);
}

/// A message is a tenth of a second old or two, in which a vehicle turns by several bins: receivers take it
/// for now.
TEST(AutopilotLink, SectorsAreTurnedToTheHeadingAtWhichTheyLeave) {
  for (const double degrees : {0.0, 60.0, -100.0}) {
    Bench bench;
    bench.turn_rate = degrees * std::numbers::pi / 180;
    bench.run(5);
    mavlink::ObstacleDistance message;
    message.increment = 5;
    message.distances.fill(65535);
    message.distances[3] = 250;
    bench.link().offer(with(message), {bench.now().nanoseconds - 250 * kMillisecond});
    bench.run(0.01);
    ASSERT_EQ(bench.sectors.size(), 1U);
    const auto found =
        std::find(bench.last_sectors.distances.begin(), bench.last_sectors.distances.end(), 250);
    const auto bin = found - bench.last_sectors.distances.begin();
    // Clockwise by 15 degrees: what was 15 degrees to the right is ahead.
    EXPECT_EQ(bin, (72 + 3 - std::lround(degrees * 0.25 / 5)) % 72) << degrees;
  }
}

/// Receivers would take sectors that say nothing for a sign of health.
TEST(AutopilotLink, SectorsThatSayNothingAreNotSentAndThatIsSaid) {
  Bench bench;
  bench.run(5);
  bench.link().offer(FrameObstacles{}, bench.now());
  bench.run(1);
  EXPECT_TRUE(bench.sectors.empty());
  EXPECT_EQ(bench.link().report().missing, Missing::view);
  EXPECT_THAT(bench.texts.back().second, HasSubstr("nothing is seen at this height"));
}

TEST(AutopilotLink, IsNotActiveWhileItsSectorsAreTooOldToBeSent) {
  Bench bench;
  bench.run(5);
  for (int i = 0; i < 20; ++i) {
    bench.link().offer(with(mavlink::ObstacleDistance{}), {bench.now().nanoseconds - 350 * kMillisecond});
    bench.run(0.1);
  }
  EXPECT_EQ(bench.link().report().missing, Missing::late);
  EXPECT_NE(bench.heartbeats.back().state, kActiveState);
  EXPECT_THAT(bench.texts.back().second, HasSubstr("sectors are too old"));
}

TEST(AutopilotLink, AnInputThatComesAndGoesFloodsNobody) {
  Bench bench;
  bench.run(5);
  bench.texts.clear();
  bench.heartbeats.clear();
  for (int i = 0; i < 20; ++i) {
    bench.camera = i % 2 == 1;
    bench.run(0.5);
  }
  EXPECT_LE(bench.texts.size(), 11U);
  EXPECT_LE(bench.heartbeats.size(), 40U);
  EXPECT_GE(bench.texts.size(), 5U);
}

TEST(AutopilotLink, NamesTheMessageThatThePosesLack) {
  Bench bench;
  bench.positions = false;
  bench.run(5);
  const LinkReport report = bench.link().report();
  EXPECT_FALSE(report.poses_come);
  EXPECT_EQ(report.poses, 0U);
  EXPECT_THAT(report.poses_summary, ::testing::MatchesRegex("[1-9][0-9][0-9]+ attitudes, 0 positions"));
  EXPECT_THAT(bench.texts.back().second, HasSubstr("no LOCAL_POSITION_NED"));
  EXPECT_GE(bench.commands.size(), 4U) << "plenty of attitudes are no reason to stop asking for positions";
}

/// When GNSS is lost the positions stop and the attitudes go on: that is no cable.
TEST(AutopilotLink, NamesTheMessageThatHasStopped) {
  for (bool Bench::*const input : {&Bench::positions, &Bench::attitudes}) {
    Bench bench;
    bench.run(5);
    ASSERT_EQ(bench.link().report().missing, Missing::nothing);
    bench.*input = false;
    bench.texts.clear();
    bench.run(3);
    ASSERT_EQ(bench.texts.size(), 1U);
    EXPECT_THAT(
        bench.texts.back().second,
        HasSubstr(input == &Bench::positions ? "no pose: no LOCAL_POSITION_NED" : "no pose: no ATTITUDE"));
    EXPECT_NE(bench.heartbeats.back().state, kActiveState);
  }
}

TEST(AutopilotLink, WhatTheReceiverSaidIsNotKeptForEver) {
  Bench bench;
  bench.gnss = true;
  bench.run(2);
  ASSERT_TRUE(bench.link().report().gnss);
  EXPECT_EQ(bench.link().report().gnss->satellites, 11);
  bench.gnss = false;
  bench.run(2.5);
  EXPECT_TRUE(bench.link().report().gnss);
  bench.run(1);
  EXPECT_FALSE(bench.link().report().gnss);
}

/// They are of the exposure, a quarter of a second ago; in the meantime the vehicle has moved and turned.
TEST(AutopilotLink, PointsAreThoseOfWhereTheVehicleIsByNow) {
  LinkOptions options;
  options.obstacles = ObstacleMessages::faces;
  for (const double degrees : {0.0, 40.0}) {
    Bench bench(options);
    bench.kind = ardupilot_kind;
    bench.turn_rate = degrees * std::numbers::pi / 180;
    bench.run(5);
    bench.link().offer(with({}, {{Eigen::Vector3d(5, 0, 0), Eigen::Vector3d(6, 0, 4)}}),
                       {bench.now().nanoseconds - 250 * kMillisecond});
    bench.run(0.01);
    EXPECT_TRUE(bench.sectors.empty());
    ASSERT_EQ(bench.points.size(), 4U) << "two faces, twice";
    EXPECT_NE(bench.points[0].time_boot_ms, bench.points[2].time_boot_ms);
    const auto level =
        std::min_element(bench.points.begin(), bench.points.end(),
                         [](const auto& a, const auto& b) { return std::abs(a.z) < std::abs(b.z); });
    // Clockwise by some 10 degrees, so what was ahead is to the left; 2 m/s to the north, where it looked
    // when the clock began.
    const Eigen::Vector2d now(static_cast<double>(level->x), static_cast<double>(level->y));
    EXPECT_NEAR(level->z, 0, 1e-3);
    if (degrees == 0) {
      EXPECT_NEAR((now - Eigen::Vector2d(4.5, 0)).norm(), 0, 0.1);
    } else {
      EXPECT_NEAR(std::atan2(now.y(), now.x()) * 180 / std::numbers::pi, -10, 7);
    }
    EXPECT_EQ(bench.link().report().sectors_sent, 1U);
    EXPECT_FALSE(bench.link().report().level_instead);
  }
}

/// A camera that looks down sees nothing at the vehicle's height, and points all the same.
TEST(AutopilotLink, PointsNeedNoSectors) {
  LinkOptions options;
  options.obstacles = ObstacleMessages::faces;
  for (const std::uint8_t kind : {ardupilot_kind, px4_kind}) {
    Bench bench(options);
    bench.kind = kind;
    bench.run(5);
    bench.link().offer(with({}, {{Eigen::Vector3d(3, 0, -3)}}), bench.now());
    bench.run(0.2);
    EXPECT_EQ(bench.points.size(), kind == ardupilot_kind ? 2U : 0U);
    EXPECT_TRUE(bench.sectors.empty());
    if (kind == px4_kind) {
      EXPECT_EQ(bench.link().report().missing, Missing::view);
    }
  }
}

TEST(AutopilotLink, PointsThatAnAutopilotDoesNotKnowAreSentAsDistancesAndThatIsSaid) {
  LinkOptions options;
  options.obstacles = ObstacleMessages::faces;
  Bench bench(options);
  bench.run(5);
  bench.link().offer(with(mavlink::ObstacleDistance{}, {{Eigen::Vector3d(5, 0, 0)}}), bench.now());
  bench.run(0.1);
  EXPECT_TRUE(bench.points.empty());
  EXPECT_EQ(bench.sectors.size(), 1U);
  EXPECT_TRUE(bench.link().report().level_instead);
}

TEST(AutopilotLink, OurOwnFilterAsksForSensorsAndSaysWhichIsMissing) {
  LinkOptions options;
  options.poses = PoseMessages::sensors;
  for (const std::uint8_t kind : {px4_kind, ardupilot_kind}) {
    Bench bench(options);
    bench.kind = kind;
    bench.run(5);
    const auto asked = [&](std::uint32_t id) {
      return std::any_of(bench.commands.begin(), bench.commands.end(), [&](const mavlink::CommandLong& c) {
        return c.command == 511 && c.param1 == static_cast<float>(id);
      });
    };
    EXPECT_EQ(asked(105), kind == px4_kind) << "HIGHRES_IMU";
    EXPECT_EQ(asked(27), kind == ardupilot_kind) << "RAW_IMU";
    EXPECT_TRUE(asked(24)) << "GPS_RAW_INT";
    EXPECT_FALSE(asked(31)) << "ATTITUDE_QUATERNION";
    EXPECT_FALSE(bench.link().report().poses_come);
    EXPECT_THAT(bench.texts.back().second, HasSubstr("no pose: no IMU message"));
  }
}

TEST(AutopilotLink, TakesAnotherAutopilotOnceTheFirstIsGone) {
  Bench bench;
  bench.run(3);
  ASSERT_EQ(bench.link().report().autopilot->system, 7);
  bench.change_system(9);
  bench.run(3);
  EXPECT_EQ(bench.link().report().autopilot->system, 7);  // of another vehicle, for all that we know
  bench.run(4);
  EXPECT_EQ(bench.link().report().autopilot->system, 9);
  EXPECT_EQ(bench.link().report().jumps, 1U) << "its poses are of another world";
}

/// Its pre-arm check wants a proximity sensor that speaks; what is said is nothing, and only at rest.
TEST(AutopilotLink, ArduPilotCanBeArmedAtRest) {
  Bench bench;
  bench.kind = ardupilot_kind;
  bench.armed = bench.depth = false;
  bench.run(5);
  const Time first = bench.now();
  bench.sectors.clear();
  bench.run(3);
  ASSERT_FALSE(bench.sectors.empty());
  Time last = first;
  for (const Time time : bench.sectors) EXPECT_LT(seconds_between(std::exchange(last, time), time), 0.4);
  EXPECT_LT(seconds_between(last, bench.now()), 0.4);
  for (const std::uint16_t d : bench.last_sectors.distances) EXPECT_EQ(d, kUnknownDistance);
  EXPECT_EQ(bench.link().report().sectors_sent, 0U);
  EXPECT_GE(bench.link().report().sectors_empty, bench.sectors.size());
  EXPECT_NE(bench.heartbeats.back().state, kActiveState);
  EXPECT_EQ(bench.link().report().missing, Missing::depth) << "that is still what the pilot is told";
  // What is really wrong keeps it from being armed.
  for (bool Bench::*const input : {&Bench::camera, &Bench::poses, &Bench::mapper, &Bench::heartbeat}) {
    bench.*input = false;
    bench.run(2);
    bench.sectors.clear();
    bench.run(2);
    EXPECT_TRUE(bench.sectors.empty());
    bench.*input = true;
    bench.run(3);
    bench.sectors.clear();
    bench.run(1);
    EXPECT_FALSE(bench.sectors.empty());
  }
  bench.armed = true;
  bench.run(1);  // until its heartbeat says so
  bench.sectors.clear();
  bench.run(5);
  EXPECT_TRUE(bench.sectors.empty());
}

TEST(AutopilotLink, NothingIsSentToPx4AtRest) {
  Bench bench;
  bench.armed = bench.depth = false;
  bench.run(6);
  EXPECT_TRUE(bench.sectors.empty());
}

TEST(AutopilotLink, WarnsOfEachThingOnce) {
  Bench bench;
  bench.run(5);
  bench.texts.clear();
  for (int i = 0; i < 300; ++i) {
    bench.link().warn(i % 2 == 0 ? "the map cannot be saved" : "nothing more is recorded");
    bench.camera = i < 100;
    bench.run(0.01);
  }
  ASSERT_EQ(bench.texts.size(), 3U);
  EXPECT_EQ(bench.texts[0].second, "PADE: the map cannot be saved");
  EXPECT_EQ(bench.texts[1].second, "PADE: nothing more is recorded");
  EXPECT_THAT(bench.texts[2].second, HasSubstr("no image from the camera"));
  EXPECT_GE(seconds_between(bench.texts[0].first, bench.texts[1].first), 0.99);
}

TEST(AutopilotLink, SaysThatItEnds) {
  Bench bench;
  bench.run(5);
  bench.link().end();
  bench.hear();
  EXPECT_NE(bench.heartbeats.back().state, kActiveState);
  EXPECT_THAT(bench.texts.back().second, HasSubstr("has ended"));
}

TEST(AutopilotLink, WithoutAnswersAboutTheClockThereIsNoPose) {
  Bench bench;
  bench.answers = false;
  bench.run(5);
  EXPECT_EQ(bench.link().pose_at(bench.now()).kind, PoseAnswer::Kind::not_yet);
  EXPECT_EQ(bench.link().report().missing, Missing::clock);
  EXPECT_THAT(bench.texts.back().second, HasSubstr("no TIMESYNC"));
}

}  // namespace
}  // namespace pade::live
