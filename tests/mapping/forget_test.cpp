// Free space that is not looked at is forgotten, if one asks for that.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace {

using namespace pade;
using mapping::MapChange;
using mapping::MapOptions;
using mapping::Occupancy;
using mapping::OccupancyMap;

Camera camera() {
  Camera c;
  c.width = 64;
  c.height = 48;
  c.fx = c.fy = 60;
  c.cx = 31.5;
  c.cy = 23.5;
  return c;
}

/// A wall 4 m ahead, seen at a time.
DepthImage wall(double time, float depth = 4.05F) {
  DepthImage image;
  image.time = Time::from_seconds(time);
  image.window = 1;
  image.depth = cv::Mat(48, 64, CV_32FC1, cv::Scalar(depth));
  return image;
}

MapOptions options(double forget_after) {
  MapOptions o;
  o.forget_after = forget_after;
  o.looks_baseline = 0;
  o.range = 6;
  return o;
}

OccupancyMap made(double forget_after) {
  return std::move(OccupancyMap::create(options(forget_after))).value();
}

/// Looks along x from `place`.
Pose looking(const Eigen::Vector3d& place, double yaw = 0) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())) * Eigen::Quaterniond(R),
          place};
}

constexpr double kLife = 1;

TEST(Forget, FreeTurnsToUnknownInTimeAndNotBefore) {
  OccupancyMap map = made(kLife);
  map.integrate(wall(0), camera(), looking({0, 0, 0}));
  const auto before = map.counts();
  ASSERT_GT(before.free, 1000U);
  ASSERT_GT(before.occupied, 100U);
  map.forget(Time::from_seconds(0.99));
  EXPECT_EQ(map.counts().free, before.free);
  const MapChange change = map.forget(Time::from_seconds(1.26));
  EXPECT_EQ(map.counts().free, 0U);
  EXPECT_EQ(map.counts().occupied, before.occupied);  // obstacles stay
  std::size_t said = 0;
  for (const auto& cell : change.became_unknown)
    said += std::size_t{1} << (3 * (mapping::kTreeDepth - cell.depth));
  EXPECT_EQ(said, before.free);
}

TEST(Forget, WhatIsLookedAtStays) {
  OccupancyMap map = made(kLife);
  std::size_t free = 0;
  for (int i = 0; i < 60; ++i) {
    map.integrate(wall(0.1 * i), camera(), looking({0, 0, 0}));
    if (i == 12) free = map.counts().free;  // from here on all of it is as free as can be
  }
  EXPECT_EQ(map.counts().free, free);
  EXPECT_EQ(map.at({2, 0, 0}), Occupancy::free);
}

TEST(Forget, WhatIsNoLongerLookedAtGoes) {
  OccupancyMap map = made(kLife);
  for (int i = 0; i < 10; ++i) map.integrate(wall(0.1 * i), camera(), looking({0, 0, 0}));
  for (int i = 10; i < 30; ++i) map.integrate(wall(0.1 * i), camera(), looking({0, 0, 0}, M_PI));
  EXPECT_EQ(map.at({2, 0, 0}), Occupancy::unknown);
  EXPECT_EQ(map.at({-2, 0, 0}), Occupancy::free);
  EXPECT_GT(map.counts().occupied, 1056U);  // the obstacles of both views stay
}

TEST(Forget, ALongGapForgetsAllAtOnce) {
  OccupancyMap map = made(kLife);
  map.integrate(wall(0), camera(), looking({0, 0, 0}));
  map.forget(Time::from_seconds(1e6));
  EXPECT_EQ(map.counts().free, 0U);
  map.integrate(wall(1e6 + 0.1), camera(), looking({0, 0, 0}));
  EXPECT_GT(map.counts().free, 1000U);
}

/// Several periods at once: what is touched is in order, each place once, as after one image.
TEST(Forget, WhatItTouchesIsInOrder) {
  OccupancyMap map = made(kLife);
  for (int i = 0; i < 8; ++i) map.integrate(wall(0.3 * i), camera(), looking({0, 0, 0}, 0.4 * i));
  const MapChange change = map.forget(Time::from_seconds(100));
  ASSERT_GT(change.touched.size(), 10U);
  std::uint64_t end = 0;
  for (const mapping::MapCell& cell : change.touched) {
    const std::uint64_t code = mapping::morton_code(cell.key);
    ASSERT_GE(code, end);
    end = code + mapping::voxels_of(cell.depth);
  }
}

TEST(Forget, NothingWithoutTheOption) {
  OccupancyMap map = made(0);
  map.integrate(wall(0), camera(), looking({0, 0, 0}));
  const auto before = map.counts();
  EXPECT_TRUE(map.forget(Time::from_seconds(1e6)).touched.empty());
  EXPECT_EQ(map.counts().free, before.free);
}

/// Beside a map that never forgets: what is known is the same, but for what was last shown free too long ago.
TEST(Forget, AgreesWithAMapThatNeverForgetsOnAllThatIsFresh) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  OccupancyMap forgets = made(kLife);
  OccupancyMap keeps = made(0);
  auto view = mapping::MapView::of(forgets);
  for (int i = 0; i < 80; ++i) {
    const double time = 0.1 * i;
    const Pose pose = looking({0.5 * uniform(random), 0.5 * uniform(random), 0}, M_PI * uniform(random));
    const float depth = static_cast<float>(3.5 + uniform(random));
    view = view->after(forgets, forgets.integrate(wall(time, depth), camera(), pose));
    keeps.integrate(wall(time, depth), camera(), pose);
    // The last image's own free space is known in both; occupied where a hit outweighs what is forgotten.
    for (const double z : {0.5, 1.5, 2.4}) {
      const Eigen::Vector3d point = pose * Eigen::Vector3d(0, 0, z);
      if (keeps.at(point) == Occupancy::free) {
        EXPECT_NE(forgets.at(point), Occupancy::unknown) << i << " " << z;
      }
    }
  }
  std::size_t fewer = 0;
  keeps.for_each([&](const mapping::MapCell& cell, Occupancy state) {
    const Occupancy now = forgets.at(cell.centre.cast<double>());
    // Free that is forgotten outweighs no later hit: occupied is possible.
    if (state == Occupancy::free) fewer += now == Occupancy::unknown ? 1 : 0;
  });
  EXPECT_GT(fewer, 100U);
  forgets.for_each([&](const mapping::MapCell& cell, Occupancy state) {
    EXPECT_EQ(view->at(cell.centre.cast<double>()), state);
    EXPECT_NE(keeps.at(cell.centre.cast<double>()), Occupancy::unknown);
  });
}

}  // namespace
