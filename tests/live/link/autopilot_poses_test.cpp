// Poses between messages: frames, brackets, jumps.
#include "pade/live/link/autopilot_poses.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"

namespace pade::live {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Kind = PoseAnswer::Kind;

template <class Message>
void add_to(AutopilotPoses& poses, const Message& message) {
  mavlink::Sender sender{1, 1, 0};
  const mavlink::Packet packet = pack(message, sender);
  poses.add(mavlink::look(packet.span()).frame);
}

Time at_ms(std::int64_t ms) { return {ms * 1'000'000}; }

mavlink::AttitudeQuaternion facing(std::uint32_t ms, float yaw_ned) {
  return {ms, std::cos(yaw_ned / 2), 0, 0, std::sin(yaw_ned / 2), 0, 0, 0, {}};
}

TEST(AutopilotPoses, NorthEastDownBecomesEastNorthUp) {
  AutopilotPoses poses(PoseMessages::estimate);
  add_to(poses, facing(1000, std::numbers::pi_v<float> / 2));  // east
  add_to(poses, mavlink::LocalPositionNed{1000, 1, 2, -3, 0, 0, 0});
  const PoseAnswer answer = poses.at(at_ms(1000));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_TRUE(answer.T_world_body.translation.isApprox(Vector3d(2, 1, 3)));
  const Eigen::Matrix3d R = answer.T_world_body.matrix3();
  EXPECT_TRUE(R.col(0).isApprox(Vector3d(1, 0, 0), 1e-6));  // ahead: east
  EXPECT_TRUE(R.col(1).isApprox(Vector3d(0, 1, 0), 1e-6));  // left: north
  EXPECT_TRUE(R.col(2).isApprox(Vector3d(0, 0, 1), 1e-6));
}

TEST(AutopilotPoses, AnglesMeanTheSameAsTheQuaternion) {
  AutopilotPoses angles(PoseMessages::estimate), quaternions(PoseMessages::estimate);
  const double roll = 0.2, pitch = -0.3, yaw = 2;
  const Quaterniond q = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                        Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                        Eigen::AngleAxisd(roll, Vector3d::UnitX());
  add_to(angles, mavlink::Attitude{500, 0.2F, -0.3F, 2.0F, 0, 0, 0});
  const Eigen::Quaternionf f = q.cast<float>();
  add_to(quaternions, mavlink::AttitudeQuaternion{500, f.w(), f.x(), f.y(), f.z(), 0, 0, 0, {}});
  for (AutopilotPoses* const poses : {&angles, &quaternions}) {
    add_to(*poses, mavlink::LocalPositionNed{500, 0, 0, 0, 0, 0, 0});
  }
  const Pose a = angles.at(at_ms(500)).T_world_body;
  const Pose b = quaternions.at(at_ms(500)).T_world_body;
  EXPECT_LT(a.rotation.angularDistance(b.rotation), 1e-6);
  // Nose down by 0.3 rad: what is ahead lies below.
  EXPECT_NEAR((a.rotation * Vector3d::UnitX()).z(), std::sin(pitch), 1e-6);
  // Rolled to the right: the left wing is up.
  EXPECT_GT((a.rotation * Vector3d::UnitY()).z(), 0.15);
}

TEST(AutopilotPoses, LiesBetweenTwoMessagesAndIsNeverGuessed) {
  AutopilotPoses poses(PoseMessages::estimate);
  EXPECT_EQ(poses.at(at_ms(5)).kind, Kind::not_yet);
  add_to(poses, facing(1000, 0));
  add_to(poses, mavlink::LocalPositionNed{990, 0, 0, 0, 0, 0, 0});
  add_to(poses, facing(1020, 0.1F));
  EXPECT_EQ(poses.at(at_ms(1010)).kind, Kind::not_yet);  // the position is still to come
  add_to(poses, mavlink::LocalPositionNed{1030, 0.2F, 0, 0, 5, 0, 0});
  const PoseAnswer answer = poses.at(at_ms(1010));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_NEAR(answer.T_world_body.translation.y(), 0.1, 1e-7);
  const Vector3d ahead = answer.T_world_body.rotation * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.x(), ahead.y()), 0.05, 1e-6);  // from north towards east
  EXPECT_EQ(poses.at(at_ms(1025)).kind, Kind::not_yet);
  EXPECT_EQ(poses.at(at_ms(985)).kind, Kind::never);
  EXPECT_EQ(poses.at(at_ms(985)).why, "the image is older than the poses");
  add_to(poses, facing(2000, 0));
  add_to(poses, mavlink::LocalPositionNed{2000, 4, 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.at(at_ms(1500)).kind, Kind::never);
  EXPECT_EQ(poses.at(at_ms(1500)).why, "a gap in the poses");
}

mavlink::Odometry odometry(std::uint64_t ms, float north, std::uint8_t resets) {
  mavlink::Odometry m;
  m.time_usec = ms * 1000;
  m.frame_id = 1;
  m.child_frame_id = 12;
  m.x = north;
  m.q = {1, 0, 0, 0};
  m.reset_counter = resets;
  return m;
}

TEST(AutopilotPoses, AJumpOfOdometryDividesBeforeFromAfter) {
  AutopilotPoses poses(PoseMessages::odometry);
  add_to(poses, facing(1000, 0));  // not asked for
  EXPECT_EQ(poses.attitudes() + poses.positions(), 0U);
  auto other_frame = odometry(1000, 0, 7);
  other_frame.frame_id = 20;
  add_to(poses, other_frame);
  EXPECT_EQ(poses.attitudes() + poses.positions(), 0U);
  add_to(poses, odometry(1000, 0, 7));
  add_to(poses, odometry(1030, 1, 7));
  EXPECT_EQ(poses.at(at_ms(1015)).kind, Kind::valid);
  EXPECT_EQ(poses.jumps(), 0U);
  add_to(poses, odometry(1060, 50, 8));
  EXPECT_EQ(poses.jumps(), 1U);
  EXPECT_EQ(poses.at(at_ms(1045)).kind, Kind::never);
  add_to(poses, odometry(1090, 51, 8));
  const PoseAnswer answer = poses.at(at_ms(1075));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_NEAR(answer.T_world_body.translation.y(), 50.5, 1e-6);
}

TEST(AutopilotPoses, OdometryThatHasFailedIsNoPose) {
  AutopilotPoses poses(PoseMessages::odometry);
  auto failed = odometry(1000, 0, 0);
  failed.quality = -1;
  add_to(poses, failed);
  EXPECT_EQ(poses.attitudes() + poses.positions(), 0U);
}

/// Without a counter of resets, as in LOCAL_POSITION_NED: a step that the velocity does not explain.
TEST(AutopilotPoses, AStepThatItsVelocityDoesNotExplainIsAJump) {
  const auto flown = [](float step, float speed, float turn) {
    auto made = std::make_unique<AutopilotPoses>(PoseMessages::estimate);
    AutopilotPoses& poses = *made;
    float north = 0;
    for (std::uint32_t ms = 1000; ms < 2000; ms += 40) {
      north += 0.04F * speed;
      const bool after = ms >= 1400;
      const float half = after ? turn / 2 : 0;
      add_to(poses, mavlink::AttitudeQuaternion{ms, std::cos(half), 0, 0, std::sin(half), 0, 0, 0, {}});
      add_to(poses, mavlink::LocalPositionNed{ms, north + (after ? step : 0), 0, 0, speed, 0, 0});
    }
    return made;
  };
  EXPECT_EQ(flown(0, 0, 0)->jumps(), 0U);
  EXPECT_EQ(flown(0, 15, 0)->jumps(), 0U);        // fast is no jump
  EXPECT_EQ(flown(0.1F, 5, 0.05F)->jumps(), 0U);  // a correction
  EXPECT_EQ(flown(1, 5, 0)->jumps(), 1U);
  EXPECT_EQ(flown(-2, 0, 0)->jumps(), 1U);
  EXPECT_EQ(flown(0, 5, 0.5F)->jumps(), 1U);  // a heading that was set anew
  const auto jumped = flown(1, 5, 0);
  EXPECT_EQ(jumped->at(at_ms(1380)).kind, Kind::never);
  EXPECT_EQ(jumped->at(at_ms(1500)).kind, Kind::valid);
  EXPECT_EQ(jumped->at(at_ms(1500)).jumps, 1U);
}

/// While the position is invalid PX4 does not send it, and sets it anew when it is back: the usual step lies
/// in a gap.
TEST(AutopilotPoses, AStepWithinAGapIsAJump) {
  struct Case {
    double gap;         // s
    float step, speed;  // m, m/s
    float turn;         // rad
    bool jump;
  };
  const Case cases[] = {
      {0.5, 0, 15, 0, false}, {0.5, 3, 5, 0, true},  {0.5, -0.5F, 5, 0, false}, {1.5, 0, 15, 0, false},
      {1.5, 20, 2, 0, true},  {1.5, 2, 2, 0, false},  // it may have sped up
      {2.5, 0, 0, 0, true},   {60, 0, 2, 0, true},   {0.5, 0, 2, 1.5F, true},   {0.5, 0, 2, 0.3F, false},
  };
  for (const Case& c : cases) {
    for (const bool attitudes_too : {true, false}) {
      AutopilotPoses poses(PoseMessages::estimate);
      std::uint32_t ms = 1000;
      float north = 0;
      const auto fly = [&](double seconds, bool attitudes, bool positions, float turn) {
        for (int i = 0; i < std::lround(seconds / 0.04); ++i, ms += 40, north += 0.04F * c.speed) {
          if (attitudes) add_to(poses, facing(ms, turn));
          if (positions) add_to(poses, mavlink::LocalPositionNed{ms, north, 0, 0, c.speed, 0, 0});
        }
      };
      fly(1, true, true, 0);
      fly(c.gap, !attitudes_too, false, 0);
      north += c.step;
      fly(1, true, true, attitudes_too ? c.turn : 0);
      if (c.turn > 0 && !attitudes_too) continue;
      EXPECT_EQ(poses.jumps(), c.jump ? 1U : 0U) << c.gap << " s, " << c.step << " m, " << c.turn << " rad";
      const PoseAnswer answer = poses.at(at_ms(ms - 500));
      ASSERT_EQ(answer.kind, Kind::valid);
      EXPECT_EQ(answer.jumps, c.jump ? 1U : 0U);
    }
  }
}

/// Its resets are counted by ODOMETRY itself, so a gap alone says nothing.
TEST(AutopilotPoses, AGapInOdometryIsNoJumpUnlessItsCounterSaysSo) {
  AutopilotPoses poses(PoseMessages::odometry);
  add_to(poses, odometry(1000, 0, 7));
  add_to(poses, odometry(11'000, 30, 7));
  EXPECT_EQ(poses.jumps(), 0U);
  add_to(poses, odometry(21'000, 60, 8));
  EXPECT_EQ(poses.jumps(), 1U);
}

/// Where a position that was set anew is the first to come after a gap, the attitude is not what is missing.
TEST(AutopilotPoses, AJumpIsNoMissingMessage) {
  AutopilotPoses poses(PoseMessages::estimate);
  add_to(poses, facing(1000, 0));
  EXPECT_EQ(poses.missing(), "no LOCAL_POSITION_NED");
  add_to(poses, mavlink::LocalPositionNed{1000, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.missing(), "");
  for (std::uint32_t ms = 1040; ms <= 3000; ms += 40) add_to(poses, facing(ms, 0));
  EXPECT_EQ(poses.missing(), "no LOCAL_POSITION_NED");
  add_to(poses, mavlink::LocalPositionNed{3010, 20, 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.jumps(), 1U);
  EXPECT_EQ(poses.missing(), "");
  for (std::uint32_t ms = 3050; ms <= 3500; ms += 40)
    add_to(poses, mavlink::LocalPositionNed{ms, 20, 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.missing(), "no ATTITUDE") << "now it is";
}

TEST(AutopilotPoses, AnotherAutopilotIsAJump) {
  AutopilotPoses poses(PoseMessages::estimate);
  poses.listen_to({1, 1, px4_kind, 2});
  add_to(poses, facing(1000, 0));
  add_to(poses, mavlink::LocalPositionNed{1000, 0, 0, 0, 0, 0, 0});
  poses.listen_to({1, 1, px4_kind, 2});  // each heartbeat
  EXPECT_EQ(poses.jumps(), 0U);
  poses.listen_to({2, 1, ardupilot_kind, 2});
  EXPECT_EQ(poses.jumps(), 1U);
  EXPECT_EQ(poses.newest().nanoseconds, 0);
  // It sends angles and no quaternions.
  add_to(poses, mavlink::Attitude{1040, 0, 0, 0.5F, 0, 0, 0});
  add_to(poses, mavlink::LocalPositionNed{1040, 0, 0, 0, 0, 0, 0});
  const PoseAnswer answer = poses.at(at_ms(1040));
  ASSERT_EQ(answer.kind, Kind::valid);
  EXPECT_EQ(answer.jumps, 1U);
}

TEST(AutopilotPoses, AClockThatGoesBackIsAJump) {
  AutopilotPoses poses(PoseMessages::estimate);
  add_to(poses, facing(90'000, 0));
  add_to(poses, mavlink::LocalPositionNed{90'000, 0, 0, 0, 0, 0, 0});
  add_to(poses, facing(100, 0));
  EXPECT_EQ(poses.jumps(), 1U);
  add_to(poses, mavlink::LocalPositionNed{100, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.at(at_ms(100)).kind, Kind::valid);
}

TEST(AutopilotPoses, WhatIsNoRotationIsLeftOut) {
  AutopilotPoses poses(PoseMessages::estimate);
  add_to(poses, mavlink::AttitudeQuaternion{});
  add_to(poses, mavlink::LocalPositionNed{0, std::nanf(""), 0, 0, 0, 0, 0});
  EXPECT_EQ(poses.attitudes() + poses.positions(), 0U);
}

}  // namespace
}  // namespace pade::live
