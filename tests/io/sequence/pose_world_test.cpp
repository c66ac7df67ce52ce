#include "pade/io/sequence/pose_world.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "pade/io/sequence/sequence.hpp"

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using Eigen::Vector3d;

/// Columns: x right, y down, z forward of the camera in the world.
Pose looking(const Vector3d& forward, const Vector3d& down, const Vector3d& at) {
  Eigen::Matrix3d R;
  R.col(2) = forward.normalized();
  R.col(1) = down.normalized();
  R.col(0) = R.col(1).cross(R.col(2));
  return {Eigen::Quaterniond(R), at};
}

std::vector<Pose> moved(const Pose& camera, const Vector3d& step, int count = 6) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) poses.push_back({camera.rotation, camera.translation + i * step});
  return poses;
}

TEST(GuessUp, OfALevelForwardCameraIsItsOwnUp) {
  const auto up = guess_up(moved(looking(Vector3d::UnitX(), -Vector3d::UnitZ(), {0, 0, 2}), {0.1, 0, 0}));
  ASSERT_TRUE(up);
  EXPECT_EQ(up->direction, Vector3d::UnitZ());
}

TEST(GuessUp, OfADownLookingCameraInStraightFlightIsUnknown) {
  // North-up image flying north: the camera's own up axis lies level, and nothing in the poses says so.
  const auto flight = moved(looking(-Vector3d::UnitZ(), -Vector3d::UnitY(), {0, 0, 50}), {0, 2, 0});
  EXPECT_FALSE(guess_up(flight));
  EXPECT_NE(why_no_up(flight).find("looks down"), std::string::npos);
  EXPECT_TRUE(may_point_up(Vector3d::UnitZ(), flight));
  EXPECT_FALSE(may_point_up(-Vector3d::UnitZ(), flight));
}

TEST(GuessUp, OfADownLookingCameraThatTurnsIsAgainstItsLook) {
  std::vector<Pose> lawn;
  for (int i = 0; i < 8; ++i) {
    const double yaw = i < 4 ? 0 : M_PI;
    lawn.push_back(looking(-Vector3d::UnitZ(), {std::sin(yaw), -std::cos(yaw), 0}, {3.0 * i, 0, 40}));
  }
  const auto up = guess_up(lawn);
  ASSERT_TRUE(up);
  EXPECT_EQ(up->direction, Vector3d::UnitZ());
}

TEST(GuessUp, OfEarthCentredPositionsPointsAwayFromTheEarth) {
  const Vector3d zurich(4278990, 643000, 4671500);
  const auto up = guess_up(moved(looking(Vector3d::UnitX(), Vector3d::UnitY(), zurich), {1, 0, 0}));
  ASSERT_TRUE(up);
  EXPECT_LT((up->direction - zurich.normalized()).norm(), 1e-4);
}

TEST(LocalOrigin, IsNearTheFlightOnlyWhereThatIsFar) {
  const Pose camera = looking(Vector3d::UnitX(), -Vector3d::UnitZ(), {482913.2, 4649776.5, 123.6});
  auto flight = moved(camera, {0.1, 0, 0});
  EXPECT_EQ(chosen_origin("auto", flight), Vector3d(482914, 4649777, 124));
  flight.front().translation.setZero();  // a receiver without a fix
  EXPECT_EQ(chosen_origin("auto", flight), Vector3d(482914, 4649777, 124));
  EXPECT_EQ(chosen_origin("none", flight), Vector3d::Zero());
  EXPECT_EQ(chosen_origin("1 2 3", flight), Vector3d(1, 2, 3));
  const auto near = moved(looking(Vector3d::UnitX(), -Vector3d::UnitZ(), {900, -900, 2}), {0.1, 0, 0});
  EXPECT_EQ(chosen_origin("auto", near), Vector3d::Zero());
  EXPECT_EQ(chosen_origin("flight", near), Vector3d(900, -900, 2));
}

TEST(LocalOrigin, MakesAFlightInMapCoordinatesTheSameAsOneAtZero) {
  const test::TemporaryFolder folder;
  test::Flight flight = test::make_flight();
  test::write_tum(folder / "zero", flight);
  for (Pose& pose : flight.T_world_camera) pose.translation += Vector3d(482000, 4649000, -300);
  test::write_tum(folder / "utm", flight);
  SequenceOptions options;
  options.origin = "482000 4649000 -300";
  const auto zero = Sequence::open(folder / "zero");
  const auto utm = Sequence::open(folder / "utm", options);
  ASSERT_TRUE(zero) << zero.error().message;
  ASSERT_TRUE(utm) << utm.error().message;
  ASSERT_EQ(zero->size(), utm->size());
  for (std::size_t i = 0; i < zero->size(); ++i) {
    EXPECT_LT((zero->pose(i).translation - utm->pose(i).translation).norm(), 1e-8);
    EXPECT_LT((zero->pose(i).translation - utm->frame(i)->T_world_camera.translation).norm(), 1e-8);
  }
  const auto found = Sequence::open(folder / "utm");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(found->pose(0).translation.norm(), 5);
  EXPECT_EQ(found->pose(0).translation + found->local_origin(),
            utm->pose(0).translation + utm->local_origin());
  ASSERT_FALSE(found->notes().empty());
  options.origin = "near here";
  EXPECT_FALSE(Sequence::open(folder / "utm", options));
}

}  // namespace
}  // namespace pade::io
