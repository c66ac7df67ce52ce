#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/surroundings.hpp"

#include "mapping/query/random_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

bool is_blocked(Occupancy state, UnknownSpace unknown) {
  return state == Occupancy::occupied || (state == Occupancy::unknown && unknown == UnknownSpace::blocked);
}

/// Against a search of all voxels.
void expect_distances(const OccupancyMap& map, const AlignedBox3d& box, double most) {
  const auto view = MapView::of(map);
  for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
    const DistanceField field = DistanceField::of(*view, box, unknown, most);
    std::vector<Vector3d> blocked;
    Vector3i v;
    for (v.z() = 0; v.z() < field.size().z(); ++v.z())
      for (v.y() = 0; v.y() < field.size().y(); ++v.y())
        for (v.x() = 0; v.x() < field.size().x(); ++v.x())
          if (is_blocked(map.at(field.centre(v)), unknown)) blocked.push_back(field.centre(v));
    std::mt19937_64 random(11);
    for (int i = 0; i < 1000; ++i) {
      for (int axis = 0; axis < 3; ++axis)
        v[axis] = std::uniform_int_distribution<int>(0, field.size()[axis] - 1)(random);
      double nearest = most;
      for (const Vector3d& other : blocked) nearest = std::min(nearest, (other - field.centre(v)).norm());
      ASSERT_NEAR(field.at(v), nearest, 1e-9) << v.transpose();
      ASSERT_NEAR(field.distance(field.centre(v)), nearest, 1e-9);
    }
  }
}

TEST(DistanceField, HasTheDistanceToTheNearestOfAllVoxels) {
  const OccupancyMap map = random_map(11);
  expect_distances(map, {Vector3d(-1.5, -1, -0.7), Vector3d(1.2, 1.3, 0.6)}, 0.8);
  expect_distances(map, {Vector3d(-0.9, -2, -0.7), Vector3d(1.3, -1, 0.6)}, 20);  // more than 16 bits hold
  const double end = 3276.8;                                                      // of what can be addressed
  expect_distances(map, {Vector3d(end - 1, -1, -0.5), Vector3d(end + 9, 0, 0.5)}, 1.5);
  expect_distances(map, {Vector3d(-1, -1, -end - 9), Vector3d(0, 0, 1 - end)}, 1.5);
}

TEST(DistanceField, RisesAlongItsGradient) {
  const auto view = MapView::of(random_map(12));
  const AlignedBox3d box(Vector3d(-2, -2, -1), Vector3d(2, 2, 1));
  const DistanceField field = DistanceField::of(*view, box, UnknownSpace::free);
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int i = 0; i < 500; ++i) {
    const Vector3d share(unit(random), unit(random), unit(random));
    const Vector3d at = box.min() + share.cwiseProduct(box.sizes());
    const Vector3d gradient = field.gradient(at);
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-7;
      const Vector3d step = kStep * Vector3d::Unit(axis);
      const double slope = (field.distance(at + step) - field.distance(at - step)) / (2 * kStep);
      EXPECT_NEAR(gradient[axis], slope, 1e-4);
    }
  }
  EXPECT_TRUE(std::isnan(field.distance({9, 0, 0})));
  EXPECT_TRUE(std::isnan(field.gradient({0, std::nan(""), 0}).x()));
}

TEST(Sectors, HaveTheNearestVoxelOfEachDirection) {
  const OccupancyMap map = random_map(13);
  const auto view = MapView::of(map);
  const Vector3d place(0.33, -0.21, 0.14);
  constexpr double kReach = 4;
  for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
    const auto found = sectors(*view, place, kReach, 0.5, 0.5, unknown);
    // Dense points of every voxel that blocks, by the octree.
    std::array<double, kSectors> expected{};
    expected.fill(std::numeric_limits<double>::infinity());
    for (double x = -4.05; x < 5; x += 0.1) {
      for (double y = -4.95; y < 5; y += 0.1) {
        bool blocked = false;
        for (double z = -0.35; z < 0.66; z += 0.1)
          blocked = blocked || is_blocked(map.at({x, y, z}), unknown);
        if (!blocked) continue;
        for (int i = 0; i < 121; ++i) {
          const double dx = x - 0.05 + 0.00999 * (i % 11) - place.x() + 1e-5;
          const double dy = y - 0.05 + 0.00999 * (i / 11) - place.y() + 1e-5;  // NOLINT
          const double distance = std::hypot(dx, dy);
          if (distance > kReach) continue;
          const auto sector =
              static_cast<std::size_t>(std::lround(std::atan2(dy, dx) / (2 * std::numbers::pi) * 72) + 72) %
              72;
          expected[sector] = std::min(expected[sector], distance);
        }
      }
    }
    for (std::size_t i = 0; i < kSectors; ++i) {
      // A voxel counts in all sectors that it touches, with its nearest point: never farther than what is
      // there.
      if (std::isfinite(expected[i])) {
        EXPECT_LE(found[i], expected[i] + 1e-9) << i;
      }
      if (std::isfinite(found[i]) && found[i] < kReach - 0.2) {
        EXPECT_GE(found[i], std::min({expected[i], expected[(i + 1) % 72], expected[(i + 71) % 72]}) - 0.12)
            << i;
      }
    }
  }
}

TEST(Frontiers, AreFreeVoxelsBesideUnknownOnes) {
  const OccupancyMap map = random_map(14);
  const auto view = MapView::of(map);
  const AlignedBox3d box(Vector3d(-2, -2, -1), Vector3d(2, 2, 1));
  const auto found = frontiers(*view, box);
  std::size_t expected = 0;
  for (double z = -0.95; z < 1; z += 0.1)
    for (double y = -1.95; y < 2; y += 0.1)
      for (double x = -1.95; x < 2; x += 0.1) {
        if (map.at({x, y, z}) != Occupancy::free) continue;
        bool beside = false;
        for (int axis = 0; axis < 3; ++axis)
          for (const double side : {-0.1, 0.1}) {
            const Vector3d step = side * Vector3d::Unit(axis);
            beside = beside || map.at(Vector3d(x, y, z) + step) == Occupancy::unknown;
          }
        expected += beside ? 1 : 0;
      }
  EXPECT_GT(expected, 100U);
  // The box is rounded outwards to voxels: those at its upper border are ours too.
  std::size_t inside = 0;
  for (const Vector3d& at : found) inside += box.contains(at) ? 1 : 0;
  EXPECT_EQ(inside, expected);
}

/// Two voxels are in one group if a chain of voxels that touch leads from one to the other: each takes over
/// the least number of what it touches, until nothing changes.
TEST(Frontiers, AreGroupedByWhatTouches) {
  const auto view = MapView::of(random_map(15));
  auto found = frontiers(*view, AlignedBox3d(Vector3d(-2, -2, -1), Vector3d(1, 1, 1)));
  std::mt19937_64 random(15);
  std::erase_if(found, [&random](const Vector3d& /*at*/) { return random() % 4 != 0; });  // many groups
  ASSERT_GT(found.size(), 100U);
  std::vector<std::size_t> label(found.size());
  for (std::size_t i = 0; i < label.size(); ++i) label[i] = i;
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t k = 0; k < found.size(); ++k) {
        if (label[k] >= label[i] || (found[i] - found[k]).cwiseAbs().maxCoeff() > 0.15) continue;
        label[i] = label[k];
        changed = true;
      }
    }
  }
  std::vector<FrontierGroup> expected(found.size(), FrontierGroup{0, Vector3d::Zero(), {}});
  for (std::size_t i = 0; i < found.size(); ++i) {
    FrontierGroup& group = expected[label[i]];
    ++group.voxels;
    group.centre += found[i];
    group.bounds.extend(Vector3d(found[i].array() - 0.05));
    group.bounds.extend(Vector3d(found[i].array() + 0.05));
  }
  std::erase_if(expected, [](const FrontierGroup& group) { return group.voxels == 0; });
  std::stable_sort(expected.begin(), expected.end(),
                   [](const FrontierGroup& a, const FrontierGroup& b) { return a.voxels > b.voxels; });
  const auto groups = frontier_groups(found, view->voxel());
  ASSERT_EQ(groups.size(), expected.size());
  EXPECT_GT(groups.size(), 10U);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    EXPECT_EQ(groups[i].voxels, expected[i].voxels);
    const Vector3d mean = expected[i].centre / static_cast<double>(expected[i].voxels);
    EXPECT_LT((groups[i].centre - mean).norm(), 1e-9);
    EXPECT_TRUE(groups[i].bounds.isApprox(expected[i].bounds, 1e-9));
  }
  EXPECT_TRUE(frontier_groups({}, 0.1).empty());
}

}  // namespace
}  // namespace pade::mapping
