// What goes wrong on purpose goes wrong as it should.
#include "pade/closed_loop/faults.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "pade/closed_loop/passer_by.hpp"
#include "pade/closed_loop/world_measures.hpp"

#include "columns.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using simulation::Box;
using simulation::FrameMaker;
using simulation::FrameOptions;
using simulation::is_passable;
using simulation::OpenWorldScene;
using simulation::Rectangle;
using simulation::Rendering;
using simulation::World;

OpenWorldScene world_of(Place place, const Vector3d& goal) {
  return {std::move(place.scene), std::move(place.surface), {0, 0, 1.6}, goal, 0};
}

TEST(Faults, ABlankWallStandsAcrossTheWayAndLeavesOneAround) {
  for (const Vector3d& goal : {Vector3d(25, 0, 1.6), Vector3d(0, -25, 1.6)}) {
    const auto built = built_for(Fault::blank_wall, world_of(columns({{5, 8}}), goal));
    ASSERT_TRUE(built.ok()) << built.error().message;
    const Vector3d along = (goal - built->start).normalized();
    EXPECT_NEAR(built->scene.distance(built->start, along), 11.9, 1e-3);
    const Vector3d left = Vector3d::UnitZ().cross(along);
    for (const double aside : {-2.9, 2.9})
      EXPECT_NEAR(built->scene.distance(built->start + aside * left, along), 11.9, 1e-3);
    EXPECT_TRUE(std::isnan(built->scene.distance(built->start + 3.1 * left, along)));
    EXPECT_TRUE(is_passable(built->surface, built->start, built->goal));
  }
}

TEST(Faults, AWallThatClosesTheWayIsRefused) {
  World world;
  world.visuals.push_back({"ground", {}, Rectangle{Vector3d::UnitZ(), {200, 200}}, {}, true});
  for (const double side : {-1.0, 1.0}) {  // a corridor as wide as the wall
    world.visuals.push_back(
        {"side", {Eigen::Quaterniond::Identity(), {0, side * 3.1, 3}}, Box{{80, 0.4, 6}}, {}, true});
  }
  const auto built =
      built_for(Fault::blank_wall, world_of(closed_loop::built(std::move(world)), {25, 0, 1.6}));
  ASSERT_FALSE(built.ok());
  EXPECT_NE(built.error().message.find("no way around"), std::string::npos);
}

TEST(Faults, TheLowSunShinesFromAhead) {
  const auto built = built_for(Fault::low_sun, world_of(columns({{5, 3}}), {0, 25, 1.6}));
  ASSERT_TRUE(built.ok());
  ASSERT_TRUE(built->scene.world().sun);
  const Vector3d travels = built->scene.world().sun->direction.normalized();
  EXPECT_NEAR(travels.y(), -std::cos(10 * M_PI / 180), 1e-9);
  EXPECT_NEAR(travels.z(), -std::sin(10 * M_PI / 180), 1e-9);
}

TEST(Faults, OthersLeaveTheWorldAsItIs) {
  const auto built = built_for(Fault::gust, world_of(columns({{5, 3}}), {25, 0, 1.6}));
  ASSERT_TRUE(built.ok());
  EXPECT_EQ(built->scene.world().visuals.size(), 2U);
}

TEST(Faults, OneFrameInTenIsDroppedAndSomeInARow) {
  constexpr int kFrames = 20000;
  int dropped = 0;
  int run = 0;
  std::array<int, 4> runs{};
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(is_dropped(7, i), is_dropped(7, i));
    run = is_dropped(7, i) ? run + 1 : 0;
    dropped += run > 0 ? 1 : 0;
    ++runs[static_cast<std::size_t>(std::min(run, 3))];
  }
  EXPECT_NEAR(dropped, kFrames / 10, 200);
  EXPECT_GT(runs[2], 200);
  EXPECT_GT(runs[3], 50);
  int same = 0;
  for (int i = 0; i < 1000; ++i) same += is_dropped(7, i) == is_dropped(8, i) ? 1 : 0;
  EXPECT_LT(same, 900);
}

/// A flight that ends before its fault has begun says nothing about it.
TEST(Faults, HowLongAFlightWasUnderThem) {
  FaultOptions fault;
  EXPECT_EQ(fault.seconds_of(20).under, 0);
  fault.kind = Fault::gust;
  EXPECT_LE(fault.from, 3);  // 25 m take 15 s
  EXPECT_EQ(fault.seconds_of(2).under, 0);
  EXPECT_NEAR(fault.seconds_of(8).under, 8 - fault.from, 1e-12);
  EXPECT_NEAR(fault.seconds_of(15).under, 10, 1e-12);
  EXPECT_NEAR(fault.seconds_of(15).after, 5 - fault.from, 1e-12);
  fault.kind = Fault::late_stamps;
  EXPECT_EQ(fault.seconds_of(15).under, 15);
  fault.kind = Fault::crossing;
  EXPECT_EQ(fault.seconds_of(3).under, 0);
  EXPECT_GT(fault.seconds_of(15).under, 1);
}

TEST(PasserBy, CrossesTheWayWhereAndWhenItIsTold) {
  const Place place = columns({});
  const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {0, 25, 1.6}, 1};  // to the north
  const auto passer_by = PasserBy::create(task, forward_camera(160), {}, 9, 6);
  ASSERT_TRUE(passer_by.ok());
  EXPECT_NEAR(passer_by->distance({0, 5, 1.2}, 6), 4 - 0.3, 1e-12);
  EXPECT_NEAR(passer_by->distance({0, 9, 1}, 6), 0, 1e-12);
  EXPECT_NEAR(passer_by->distance({0, 9, 2.8}, 6), 1, 1e-12);            // above its head
  EXPECT_NEAR(passer_by->distance({1.4, 9, 1}, 5), 0, 1e-12);            // from the right
  EXPECT_NEAR(passer_by->distance({0, 9, 1}, 8), 2 * 1.4 - 0.3, 1e-12);  // gone by to the left
}

TEST(PasserBy, IsDrawnInFrontOfWhatIsBehindItAndNotOverWhatIsBefore) {
  const Place place = columns({{14, 0}, {4, 0.9}});
  const FlightTask task{place.scene, place.surface, {0, 0, 1}, {25, 0, 1}, 1};
  const Camera camera = forward_camera(160);
  const FrameOptions frame;
  const FrameMaker maker(place.scene, camera, frame);
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Pose pose{Eigen::Quaterniond(R), {0, 0, 1}};
  const auto still = [&](double) { return pose; };
  const auto passer_by = PasserBy::create(task, camera, frame, 9, 6);
  ASSERT_TRUE(passer_by.ok());
  Rendering light = maker.expose(pose, still);
  const Rendering without{light.radiance.clone(), light.depth.clone()};
  passer_by->draw(light, pose, 6);
  const int u = static_cast<int>(std::lround(camera.cx));
  const int v = static_cast<int>(std::lround(camera.cy));
  EXPECT_NEAR(light.depth.at<float>(v, u), 9 - 0.3, 0.02);
  EXPECT_NEAR(without.depth.at<float>(v, u), 14 - 0.3, 0.02);
  EXPECT_GT(cv::norm(light.radiance, without.radiance, cv::NORM_INF), 0.02);
  // Two metres to its left it is behind the near column.
  Rendering later = maker.expose(pose, still);
  passer_by->draw(later, pose, 6 + 0.9 / 4 * 9 / 1.4);
  const int near_u = static_cast<int>(std::lround(camera.cx - camera.fx * 0.9 / 4));
  EXPECT_EQ(later.depth.at<float>(v, near_u), without.depth.at<float>(v, near_u));
  EXPECT_LT(later.depth.at<float>(v, near_u), 4.1F);
}

TEST(WorldMeasures, OfColumnsInARow) {
  // Columns 0.6 m wide, 4 m from axis to axis, across the way at one place: gaps of 3.4 m.
  const Place place = columns({{8.5, -8}, {8.5, -4}, {8.5, 0}, {8.5, 4}, {8.5, 8}});
  const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {20, 0, 1.6}, 1};
  const WorldMeasures measures = measures_of_world(task, 0.35);
  ASSERT_TRUE(measures.relative_gap);
  EXPECT_NEAR(*measures.relative_gap, 3.4 / 0.7, 0.15);
  EXPECT_GT(measures.traversability, 20);
  EXPECT_LT(measures.traversability, 20 / 0.35);
}

TEST(WorldMeasures, NothingInTheWay) {
  const Place place = columns({});
  const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {20, 0, 1.6}, 1};
  const WorldMeasures measures = measures_of_world(task, 0.35);
  EXPECT_FALSE(measures.relative_gap);
  EXPECT_NEAR(measures.traversability, 20 / 0.35, 1e-6);  // free paths end at 20 m
}

TEST(WorldMeasures, MoreColumnsAreHarder) {
  double last = 1e9;
  for (const int n : {5, 20, 80}) {
    std::vector<Eigen::Vector2d> at;
    for (int i = 0; i < n; ++i)
      at.emplace_back(1 + 18 * std::fmod(0.618034 * i + 0.3, 1.0),
                      -6 + 12 * std::fmod(0.754878 * i + 0.1, 1.0));
    const Place place = columns(at);
    const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {20, 0, 1.6}, 1};
    const double now = measures_of_world(task, 0.35).traversability;
    EXPECT_LT(now, last) << n;
    last = now;
  }
}

}  // namespace
}  // namespace pade::closed_loop
