#include "pade/planning/local_window.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/planning/local_guide.hpp"

namespace pade::planning {
namespace {

using Eigen::Vector3d;
using mapping::Occupancy;

octomap::point3d voxel(int x, int y, int z) {
  const auto centre = [](int index) { return static_cast<float>(0.1 * index + 0.05); };
  return {centre(x), centre(y), centre(z)};
}

/// Free about the origin, with holes of unknown space and occupied voxels at random.
mapping::OccupancyMap random_map(unsigned seed, double occupied) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> number(0, 1);
  for (int x = -25; x < 25; ++x) {
    for (int y = -25; y < 25; ++y) {
      for (int z = 0; z < 30; ++z) {
        const double chance = number(engine);
        if (chance < occupied) {
          tree->updateNode(voxel(x, y, z), true);
        } else if (chance > 2 * occupied) {
          tree->updateNode(voxel(x, y, z), false);
        }
      }
    }
  }
  tree->prune();
  return std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
}

/// What the ball touches, voxel by voxel.
struct Touched {
  bool occupied = false;
  bool unfree = false;
};
Touched touched(const mapping::OccupancyMap& map, const Vector3d& p, double radius) {
  Touched out;
  const int most = static_cast<int>(radius / 0.1) + 2;
  for (int x = -most; x <= most; ++x) {
    for (int y = -most; y <= most; ++y) {
      for (int z = -most; z <= most; ++z) {
        const Vector3d centre = 0.1 * ((p / 0.1).array().floor() + Eigen::Array3d(x, y, z) + 0.5).matrix();
        const Vector3d gap = ((p - centre).cwiseAbs() - Vector3d::Constant(0.05)).cwiseMax(0);
        if (gap.norm() >= radius) continue;
        out.occupied = out.occupied || map.at(centre) == Occupancy::occupied;
        out.unfree = out.unfree || map.at(centre) != Occupancy::free;
      }
    }
  }
  return out;
}

TEST(LocalWindow, ABallThatItCallsFreeTouchesNothingElse) {
  const mapping::OccupancyMap map = random_map(4, 0.0008);
  LocalWindow window({2, 2, 1});
  window.set(*mapping::MapView::of(map), {0.03, -0.02, 1.5}, 0.4);
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> number(-1.4, 1.4);
  int free = 0;
  int missed = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d p(number(engine), number(engine), 1.5 + 0.35 * number(engine));
    const Touched truth = touched(map, p, 0.4);
    if (window.is_free(p)) {
      ++free;
      EXPECT_FALSE(truth.unfree) << p.transpose();
    }
    EXPECT_FALSE(window.is_clear(p) && truth.occupied) << p.transpose();
    // One voxel more on all sides is always enough.
    if (!touched(map, p, 0.58).unfree && !window.is_free(p)) ++missed;
    EXPECT_EQ(window.at(p), map.at(p));
  }
  EXPECT_GT(free, 20);
  EXPECT_EQ(missed, 0);
}

TEST(LocalWindow, KnowsNothingBeyondItselfAndWhatItIsTold) {
  const auto map = mapping::OccupancyMap::create();
  LocalWindow window({2, 2, 1});
  window.set(*mapping::MapView::of(*map), {0, 0, 1}, 0.3);
  EXPECT_FALSE(window.is_free({0, 0, 1}));
  EXPECT_TRUE(window.is_clear({0, 0, 1}));
  const std::array place = {Vector3d(0, 0, 1)};
  window.set(*mapping::MapView::of(*map)->flown(place, 0.8), {0, 0, 1}, 0.3);
  EXPECT_TRUE(window.is_free({0, 0, 1}));
  EXPECT_TRUE(window.is_free({0.2, 0, 1}));
  EXPECT_FALSE(window.is_free({0.6, 0, 1}));
  EXPECT_FALSE(window.is_free({30, 0, 1}));
}

TEST(LocalGuide, LeadsStraightWhereNothingStandsAndAroundAWall) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  for (int y = -30; y < 15; ++y) {
    for (int z = 0; z < 32; ++z) tree->updateNode(voxel(10, y, z), true);
  }
  const auto walled = mapping::OccupancyMap::create({}, std::move(tree));
  const auto empty = mapping::OccupancyMap::create();
  LocalWindow window({4, 4, 1.6});
  LocalGuide guide;
  const LocalGuide::Heights heights{0.7, 2.8};
  const Vector3d goal(10, 0, 1.6);
  window.set(*mapping::MapView::of(*empty), {0, 0, 1.6}, 0.4);
  guide.set(window, goal, heights);
  EXPECT_NEAR(guide.to_go({0, 0, 1.6}), 4 * 1.5 + 6, 0.7);  // unseen up to the edge
  EXPECT_LT(guide.to_go({1, 0, 1.6}), guide.to_go({0, 0, 1.6}));
  EXPECT_EQ(guide.to_go({20, 0, 1.6}), std::numeric_limits<double>::infinity());
  window.set(*mapping::MapView::of(*walled), {0, 0, 1.6}, 0.4);
  guide.set(window, goal, heights);
  EXPECT_LT(guide.to_go({0.3, 1, 1.6}), guide.to_go({0.3, 0, 1.6}));  // the end of the wall is at y = 1.5 m
  EXPECT_GT(guide.to_go({0, 0, 1.6}), 4 * 1.5 + 6 + 0.5);
}

/// Unseen space costs half as much again as seen space, and where it was given up so much that a way around
/// is taken.
TEST(LocalGuide, LeadsAroundWhatWasGivenUp) {
  const auto map = mapping::OccupancyMap::create();
  const std::array sides = {Vector3d(2, -3, 1.6), Vector3d(2, 3, 1.6)};
  LocalWindow window({6.4, 6.4, 1.6});
  window.set(*mapping::MapView::of(*map)->flown(sides, 0.6), {0, 0, 1.6}, 0.4);
  LocalGuide guide;
  const LocalGuide::Heights heights{0.7, 2.8};
  const Vector3d goal(5, 0, 1.6);
  guide.set(window, goal, heights);
  const double straight = guide.to_go({0, 0, 1.6});
  EXPECT_NEAR(straight, 5 * 1.5, 0.4);
  const std::array hidden = {HiddenSpace{{2, 0, 0}, 1}};
  guide.set(window, goal, heights, 0, hidden);
  EXPECT_GT(guide.to_go({0, 0, 1.6}), straight + 0.3);
  EXPECT_LT(guide.to_go({0, 0, 1.6}),
            straight + 3);  // around, and not through two metres at six times the price
  EXPECT_NEAR(guide.to_go({4, 0, 1.6}), 1.5, 0.2);  // beyond it nothing has changed
}

/// Something 40 cm or 2.4 m wide stands at the goal, or a wall all around it. That used to leave no way at
/// all.
TEST(LocalGuide, LeadsTowardAGoalThatIsBlocked) {
  for (const auto& [reach, hollow] : {std::pair{2, 0}, std::pair{12, 0}, std::pair{18, 14}}) {
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    for (int x = -reach; x < reach; ++x) {
      for (int y = -reach; y < reach; ++y) {
        const bool inside = x >= -hollow && x < hollow && y >= -hollow && y < hollow;
        for (int z = 0; z < 40 && !inside; ++z) tree->updateNode(voxel(30 + x, y, z), true);
      }
    }
    const auto map = mapping::OccupancyMap::create({}, std::move(tree));
    LocalWindow window({6.4, 6.4, 1.6});
    window.set(*mapping::MapView::of(*map), {0, 0, 1.6}, 0.4);
    LocalGuide guide;
    guide.set(window, {3, 0, 1.6}, {0.7, 2.8}, 1);
    const double far = guide.to_go({-1, 0, 1.6});
    ASSERT_TRUE(std::isfinite(far)) << reach;
    if (hollow == 0) {
      EXPECT_LT(guide.to_go({0, 0, 1.6}), far - 1) << reach;
    }
  }
}

}  // namespace
}  // namespace pade::planning
