// Poses of a topic: between messages, jumps, and what is said where none come.
#include "pade/live/dds/dds_poses.hpp"

#include <algorithm>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/mavlink/parser.hpp"

#include "live/dds/fake_network.hpp"
#include "live/dds/still_clocks.hpp"

namespace pade::live {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using Kind = PoseAnswer::Kind;
constexpr auto kPosesTestCdr = io::MessageEncoding::cdr;

class DdsPosesTest : public testing::Test {
 protected:
  std::unique_ptr<DdsPoses> open(const Pose& T_body_camera = {}) {
    auto poses = DdsPoses::open(network_, shared_, options_, T_body_camera);
    EXPECT_TRUE(poses.ok());
    return std::move(*poses);
  }
  [[nodiscard]] Time at(double seconds) const {
    return {start_.nanoseconds + static_cast<std::int64_t>(seconds * 1e9)};
  }
  void give(double seconds, const Vector3d& place, double yaw = 0, const std::string& frame = "odom") {
    Pose pose;
    pose.translation = place;
    pose.rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ());
    network_.topics.give("/odom", io::write_odometry({shared_.clock.to_stamp(at(seconds)), frame}, "base",
                                                     pose, kPosesTestCdr));
  }

  FakeNetwork network_;
  DdsOptions options_;
  std::int64_t moved_ = 0;
  DdsShared shared_{options_, still_clocks(moved_)};
  Time start_{kStillOurs.nanoseconds - 500'000'000};
};

TEST_F(DdsPosesTest, LieOnTheWayBetweenTwoMessages) {
  const auto poses = open();
  EXPECT_EQ(network_.topics.types["/odom"], "nav_msgs/Odometry");
  give(0, {1, 2, 3}, 0);
  give(0.1, {1.1, 2, 3}, 0.2);
  const PoseAnswer answer = poses->at(at(0.025));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_NEAR((answer.T_world_body.translation - Vector3d(1.025, 2, 3)).norm(), 0, 1e-9);
  EXPECT_NEAR(answer.T_world_body.rotation.angularDistance(
                  Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Vector3d::UnitZ()))),
              0, 1e-9);
  EXPECT_EQ(poses->at(at(0.11)).kind, Kind::not_yet);
  EXPECT_EQ(poses->at(at(-0.01)).kind, Kind::never);
  EXPECT_NEAR(poses->turned_since(at(0)), -0.2, 1e-9) << "clockwise counts";
  EXPECT_EQ(shared_.names.now().world, "odom");
  EXPECT_EQ(shared_.names.now().body, "base");
  give(0.4, {1.4, 2, 3});
  EXPECT_EQ(poses->at(at(0.2)).kind, Kind::never) << "a gap of 0.3 s is not bridged";
}

TEST_F(DdsPosesTest, OfACameraBecomeThoseOfTheBody) {
  options_.pose_of = PoseOf::camera;
  Pose mounting;
  mounting.translation = {0.1, 0, -0.05};
  mounting.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  const auto poses = open(mounting);
  Pose body;
  body.translation = {3, 4, 5};
  body.rotation = Eigen::AngleAxisd(1, Vector3d(1, 2, 3).normalized());
  network_.topics.give("/odom", io::write_odometry({shared_.clock.to_stamp(at(0)), "map"}, "camera",
                                                   body * mounting, kPosesTestCdr));
  const PoseAnswer answer = poses->at(at(0));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_NEAR((answer.T_world_body.translation - body.translation).norm(), 0, 1e-9);
  EXPECT_NEAR(answer.T_world_body.rotation.angularDistance(body.rotation), 0, 1e-7);
  EXPECT_EQ(shared_.names.now().body, "base_link") << "the child is the camera";
}

TEST_F(DdsPosesTest, AJumpIsWhatTheMotionBeforeDoesNotLeadTo) {
  const auto poses = open();
  for (int i = 0; i < 10; ++i) give(0.033 * i, {0.5 * i, 0, 0}, 0.05 * i);  // 15 m/s, turning
  EXPECT_EQ(poses->at(at(0.1)).jumps, 0U);
  EXPECT_EQ(poses->jumps(), 0U);
  give(0.33, {5.0 + 0.5, 0, 0}, 0.5);  // half a metre off
  EXPECT_EQ(poses->at(at(0.33)).jumps, 1U);
  EXPECT_EQ(poses->at(at(0.3)).kind, Kind::never) << "what was before is of another map";
  for (int i = 1; i < 4; ++i) give(0.33 + 0.033 * i, {5.5 + 0.5 * i, 0, 0}, 0.5);
  EXPECT_EQ(poses->at(at(0.42)).jumps, 1U);
  give(0.462, {7.5, 0, 0}, 0.9);  // 0.4 rad in 33 ms
  EXPECT_EQ(poses->at(at(0.462)).jumps, 2U);
  give(0.495, {8, 0, 0}, 0.9, "map");
  EXPECT_EQ(poses->at(at(0.495)).jumps, 3U) << "another frame";
}

/// A simultaneous localisation and mapping that has lost its way begins elsewhere, after a silence.
TEST_F(DdsPosesTest, AJumpInASilenceIsOneToo) {
  const auto poses = open();
  for (const double silence : {0.6, 5.0}) {
    const std::size_t before = poses->jumps();
    for (int i = 0; i < 10; ++i) {
      moved_ += 50'000'000;
      start_.nanoseconds += 50'000'000;
      give(0, {0.05 * i, 0, 0});
    }
    (void)poses->newest();
    EXPECT_LE(poses->jumps(), before + 1) << "only that back to the start of this test";
    const std::size_t then = poses->jumps();
    moved_ += static_cast<std::int64_t>(silence * 1e9);
    start_.nanoseconds += static_cast<std::int64_t>(silence * 1e9);
    give(0, {0.5, 5, 0});
    (void)poses->newest();
    EXPECT_EQ(poses->jumps(), then + 1) << silence;
  }
}

/// A bridge of another middleware hands 200 Hz on two by two, and stamps them then.
TEST_F(DdsPosesTest, StampsAtArrivalInPairsAreNoJumps) {
  const auto poses = open();
  for (int i = 0; i < 400; ++i) {
    if (i % 2 == 0) moved_ += 10'000'000;
    if (i % 2 == 0) start_.nanoseconds += 10'000'000;
    give(i % 2 == 0 ? -0.0001 : 0, {0.01 * i, 0, 0});
    (void)poses->newest();
  }
  EXPECT_EQ(poses->jumps(), 0U);
  EXPECT_EQ(poses->count(), 400U);
}

TEST_F(DdsPosesTest, WhatCannotBeUsedIsLeftOutAndSaid) {
  const auto poses = open();
  EXPECT_EQ(poses->missing(), "nobody publishes it");
  EXPECT_EQ(poses->newest().nanoseconds, 0);
  Pose pose;
  pose.rotation.coeffs().setZero();
  network_.topics.give("/odom",
                       io::write_odometry({shared_.clock.to_stamp(at(0)), "odom"}, "", pose, kPosesTestCdr));
  EXPECT_THAT(poses->missing(), HasSubstr("/odom: found a quaternion of length 0"));
  network_.topics.give("/odom", io::write_odometry({{7}, "odom"}, "", Pose{}, kPosesTestCdr));
  EXPECT_THAT(poses->missing(), HasSubstr("another clock (dds.clock)"));
  network_.topics.give("/odom", "rubbish");
  EXPECT_THAT(poses->missing(), HasSubstr("the message ends within its fields"));
  give(0.4, {0, 0, 0});
  EXPECT_EQ(poses->missing(), "");
  give(0.39, {0, 0, 0});
  (void)poses->newest();
  EXPECT_THAT(poses->summary(), HasSubstr("1 messages of /odom, 4 left out"));
}

TEST_F(DdsPosesTest, ThePilotIsToldWhichTopicIsSilent) {
  network_.topics.remark = "nobody publishes /odom in domain 0";
  LinkOptions options;
  options.port = "none";
  options.poses = PoseMessages::dds;
  auto port = open_port(options.port, options.baud);
  ASSERT_TRUE(port.ok());
  AutopilotLink link(std::move(*port), options, open());
  Progress progress;
  progress.image = progress.mapper = progress.depth = shared_.clock.now().nanoseconds;
  link.step(shared_.clock.now(), progress);
  EXPECT_EQ(text_of(link.report()), "no pose: nobody publishes /odom in domain 0");
  give(0.45, {0, 0, 0});
  progress.image = progress.mapper = progress.depth = shared_.clock.now().nanoseconds;
  link.step(shared_.clock.now(), progress);
  EXPECT_EQ(text_of(link.report()), "obstacle mapping active")
      << "without an autopilot nothing else is missing";
  EXPECT_EQ(link.pose_at(at(0.45)).kind, Kind::valid);
  const Time later{shared_.clock.now().nanoseconds + 1'000'000'000};
  progress.image = progress.mapper = progress.depth = later.nanoseconds;
  link.step(later, progress);
  EXPECT_EQ(link.report().missing, Missing::pose);
}

/// An autopilot's end of a line: a heartbeat comes, and what is sent is kept.
class ListeningPort : public Port {
 public:
  ListeningPort(std::vector<std::uint8_t>& to_us, std::vector<std::uint8_t>& from_us)
      : to_us_(to_us), from_us_(from_us) {}
  void wait(int /*milliseconds*/) override {}
  std::size_t read(std::span<std::uint8_t> bytes) override {
    const std::size_t count = std::min(bytes.size(), to_us_.size());
    std::copy_n(to_us_.begin(), count, bytes.begin());
    to_us_.erase(to_us_.begin(), to_us_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    from_us_.insert(from_us_.end(), bytes.begin(), bytes.end());
    return true;
  }

 private:
  std::vector<std::uint8_t>& to_us_;
  std::vector<std::uint8_t>& from_us_;
};

TEST_F(DdsPosesTest, APilotIsToldBySTATUSTEXTThoughTheAutopilotsClockIsNotKnown) {
  network_.topics.remark = "nobody publishes /odom in domain 0";
  std::vector<std::uint8_t> to_us, from_us;
  LinkOptions options;
  options.poses = PoseMessages::dds;
  AutopilotLink link(std::make_unique<ListeningPort>(to_us, from_us), options, open());
  mavlink::Sender sender{1, 1, 0};
  std::vector<std::string> texts;
  std::vector<int> states;
  const auto go_on = [&](double seconds) {
    const mavlink::Packet packet = pack(mavlink::Heartbeat{2, 12, 0, 0, 4, 3}, sender);
    to_us.assign(packet.span().begin(), packet.span().end());
    moved_ += static_cast<std::int64_t>(seconds * 1e9);
    Progress progress;
    progress.image = progress.mapper = progress.depth = shared_.clock.now().nanoseconds;
    link.step(shared_.clock.now(), progress);
    mavlink::Parser parser;
    parser.add(from_us, [&](const mavlink::Frame& frame) {
      if (const auto text = mavlink::unpack<mavlink::StatusText>(frame))
        texts.emplace_back(text->text.data());
      if (const auto beat = mavlink::unpack<mavlink::Heartbeat>(frame)) states.push_back(beat->system_status);
    });
    from_us.clear();
  };
  constexpr int kStandbyState = 3, kActiveState = 4;
  go_on(0);
  EXPECT_THAT(texts, testing::ElementsAre("PADE: no pose: nobody publishes /odom in domain 0"));
  EXPECT_EQ(states.back(), kStandbyState);
  give(0.5 + 1.2, {0, 0, 0});
  go_on(1.2);
  EXPECT_EQ(texts.back(), "PADE: obstacle mapping active");
  EXPECT_EQ(states.back(), kActiveState);
  network_.topics.remark = "";
  go_on(1.2);
  EXPECT_EQ(texts.back(), "PADE: no pose: nothing on /odom any more");
  EXPECT_EQ(states.back(), kStandbyState);
}

}  // namespace
}  // namespace pade::live
