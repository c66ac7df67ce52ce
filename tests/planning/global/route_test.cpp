#include "pade/planning/global/route.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace pade::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using mapping::MapView;
using mapping::Occupancy;
using mapping::OccupancyMap;
using mapping::UnknownSpace;
using ::testing::HasSubstr;

constexpr double kVoxel = 0.1;

/// A free room, x from 0 to 8 m, y from -2 to 2, z from 0 to 2, divided by a wall at x = 4 with a gap of 1.4
/// m, or none.
OccupancyMap room(bool gap) {
  auto tree = std::make_unique<octomap::OcTree>(kVoxel);
  for (double x = 0.05; x < 8; x += kVoxel) {
    for (double y = -1.95; y < 2; y += kVoxel) {
      for (double z = 0.05; z < 2; z += kVoxel) {
        const bool wall = std::abs(x - 4) < 0.2 && !(gap && y > 0.4 && y < 1.8 && z > 0.3 && z < 1.7);
        tree->setNodeValue(x, y, z, wall ? 3.4F : -2.0F, true);
      }
    }
  }
  tree->updateInnerOccupancy();
  tree->prune();
  return std::move(OccupancyMap::create({}, std::move(tree))).value();
}

const Vector3d kStart(1, -1, 1);
const Vector3d kGoal(7, -1, 1);

/// Every voxel around is asked of the octree.
double clearance(const OccupancyMap& map, const Vector3d& point, double reach) {
  double nearest = reach;
  const int n = static_cast<int>(std::ceil(reach / kVoxel)) + 1;
  const Vector3d middle = (point.array() / kVoxel).floor() + 0.5;
  for (int z = -n; z <= n; ++z) {
    for (int y = -n; y <= n; ++y) {
      for (int x = -n; x <= n; ++x) {
        const Vector3d centre = kVoxel * (middle + Vector3d(x, y, z));
        const AlignedBox3d cube(centre.array() - kVoxel / 2, centre.array() + kVoxel / 2);
        if (map.at(centre) != Occupancy::free) nearest = std::min(nearest, cube.exteriorDistance(point));
      }
    }
  }
  return nearest;
}

void expect_within(const std::vector<MotionPoint>& points, const MotionLimits& limits) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(points[i].velocity.norm(), limits.speed * (1 + 1e-9));
    if (i == 0) continue;
    const double step = points[i].time - points[i - 1].time;
    ASSERT_GT(step, 0);
    const Vector3d change = points[i].velocity - points[i - 1].velocity;
    EXPECT_LE(change.norm() / step, limits.acceleration * (1 + 1e-6)) << points[i].time;
    const Vector3d mean = 0.5 * (points[i].velocity + points[i - 1].velocity);
    EXPECT_LT((points[i].position - points[i - 1].position - step * mean).norm(), 1e-8) << points[i].time;
  }
  EXPECT_EQ(points.front().velocity, Vector3d::Zero());
  EXPECT_EQ(points.back().velocity, Vector3d::Zero());
}

TEST(Route, LeadsThroughTheGapClearOfEveryVoxelWithinTheLimits) {
  const OccupancyMap map = room(true);
  RouteOptions options;
  const auto route = plan_route(*MapView::of(map), kStart, kGoal, options);
  ASSERT_TRUE(route) << route.error().message;
  EXPECT_EQ(route->points.front().position, kStart);
  EXPECT_EQ(route->points.back().position, kGoal);
  for (std::size_t i = 0; i < route->points.size(); i += 3)
    EXPECT_GE(clearance(map, route->points[i].position, 0.6), options.radius - 1e-9);
  expect_within(route->points, options.motion);
  // Through the gap, its edges kept clear by the radius: 7.2 m is the shortest.
  EXPECT_LT(route->length, 1.05 * 7.2);
  EXPECT_GT(route->length, 6.9);
}

TEST(Route, IsTheSameEachTime) {
  const auto view = MapView::of(room(true));
  RouteOptions options;
  options.improvements = 300;
  const auto first = plan_route(*view, kStart, kGoal, options);
  RouteOptions other = options;
  other.seed = 2;
  const auto between = plan_route(*view, kStart, kGoal, other);
  const auto second = plan_route(*view, kStart, kGoal, options);
  ASSERT_TRUE(first && between && second);
  ASSERT_EQ(first->points.size(), second->points.size());
  EXPECT_EQ(first->corners, second->corners);
  EXPECT_NE(first->corners, between->corners);
}

TEST(Route, NamesWhatIsWrongWithItsEnds) {
  const auto view = MapView::of(room(true));
  const auto message = [&](const Vector3d& start, const Vector3d& goal, UnknownSpace unknown) {
    RouteOptions options;
    options.unknown = unknown;
    const auto route = plan_route(*view, start, goal, options);
    return route ? std::string("a route") : route.error().message;
  };
  const double none = std::nan("");
  EXPECT_THAT(message({4, -1, 1}, kGoal, UnknownSpace::blocked),
              HasSubstr("start (4.00, -1.00, 1.00) is occupied"));
  EXPECT_THAT(message(kStart, {7, 2.1, 1}, UnknownSpace::blocked),
              HasSubstr("goal (7.00, 2.10, 1.00) is unknown"));
  EXPECT_THAT(message(kStart, {90, 0, 1}, UnknownSpace::blocked),
              HasSubstr("goal (90.00, 0.00, 1.00) is outside"));
  EXPECT_THAT(message({1, 1.8, 1}, kGoal, UnknownSpace::blocked), HasSubstr("nearer than 0.45 m to unknown"));
  EXPECT_THAT(message({3.6, -1, 1}, kGoal, UnknownSpace::free), HasSubstr("nearer than 0.45 m to occupied"));
  EXPECT_THAT(message({none, 0, 0}, kGoal, UnknownSpace::free), HasSubstr("start"));
  EXPECT_THAT(message(kStart, {2e6, 0, 1}, UnknownSpace::free), HasSubstr("from the map"));
}

/// However far away the goal is, a search that is to stop does.
TEST(Route, StopsWhenItIsTold) {
  const auto view = MapView::of(room(true));
  RouteOptions options;
  options.unknown = UnknownSpace::free;
  int asked = 0;
  const auto route = plan_route(*view, kStart, {900, 0, 1}, options, [&] { return ++asked > 5; });
  EXPECT_FALSE(route);
  EXPECT_LT(asked, 200);
}

TEST(Route, IsNotFoundThroughAWallButAroundItWhereUnknownSpaceIsFree) {
  const auto view = MapView::of(room(false));
  RouteOptions options;
  options.iterations = 2000;
  const auto blocked = plan_route(*view, kStart, kGoal, options);
  ASSERT_FALSE(blocked);
  EXPECT_THAT(blocked.error().message, HasSubstr("found no way"));
  options.unknown = UnknownSpace::free;
  const auto around = plan_route(*view, kStart, kGoal, options);
  ASSERT_TRUE(around) << around.error().message;
  EXPECT_FALSE(view->sweep(around->corners, options.radius, UnknownSpace::free));
}

TEST(Route, RefusesOptionsByName) {
  const auto view = MapView::of(room(true));
  for (const auto& [name, spoil] : std::vector<std::pair<const char*, void (*)(RouteOptions&)>>{
           {"radius", [](RouteOptions& o) { o.radius = std::nan(""); }},
           {"iterations", [](RouteOptions& o) { o.iterations = 0; }},
           {"improvements", [](RouteOptions& o) { o.improvements = -1; }},
           {"seed", [](RouteOptions& o) { o.seed = 0; }},
           {"motion.speed", [](RouteOptions& o) { o.motion.speed = 0; }},
           {"motion.acceleration", [](RouteOptions& o) { o.motion.acceleration = -1; }}}) {
    RouteOptions options;
    spoil(options);
    const auto route = plan_route(*view, kStart, kGoal, options);
    ASSERT_FALSE(route) << name;
    EXPECT_THAT(route.error().message, HasSubstr(name));
  }
}

TEST(Motion, StaysWithinTheLimitsAndNearItsCorners) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 200; ++i) {
    std::vector<Vector3d> corners;
    std::vector<double> rounding;
    for (int k = 0; k < 2 + i % 5; ++k) {
      const double x = 5 * unit(random);
      const double y = 5 * unit(random);
      corners.emplace_back(x, y, unit(random));
      rounding.push_back(k % 3 == 2 ? 0 : unit(random));
    }
    const MotionLimits limits{0.2 + 3 * unit(random), 0.3 + 3 * unit(random)};
    const std::vector<MotionPoint> points = motion_along(corners, rounding, limits);
    expect_within(points, limits);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const MotionPoint& point : points)
        nearest = std::min(nearest, (point.position - corners[k]).norm());
      const double leg = k > 0 && k + 1 < corners.size() ? std::min((corners[k] - corners[k - 1]).norm(),
                                                                    (corners[k + 1] - corners[k]).norm())
                                                         : 0;
      EXPECT_LE(nearest, 0.25 * rounding[k] * leg + 3e-3);  // between two points
    }
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace pade::planning
