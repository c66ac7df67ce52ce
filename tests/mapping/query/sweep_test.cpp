#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/moving_ball.hpp"

#include "mapping/query/random_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

Vector3d random_place(std::mt19937_64& random, double reach = 4) {
  std::uniform_real_distribution<double> along(-reach, reach);
  const double x = along(random);
  const double y = along(random);
  return {x, y, 0.3 * along(random)};
}

bool blocks(Occupancy state, UnknownSpace unknown) {
  return state == Occupancy::occupied || (state == Occupancy::unknown && unknown == UnknownSpace::blocked);
}

/// How near the nearest voxel that blocks comes to a point, looking as far as `reach`: every voxel is asked
/// of the octree.
double nearest_blocked(const OccupancyMap& map, const Vector3d& point, double reach, UnknownSpace unknown) {
  const double voxel = map.options().voxel;
  double nearest = std::numeric_limits<double>::infinity();
  const int n = static_cast<int>(std::ceil(reach / voxel)) + 1;
  const Vector3d middle = (point.array() / voxel).floor() + 0.5;
  for (int z = -n; z <= n; ++z) {
    for (int y = -n; y <= n; ++y) {
      for (int x = -n; x <= n; ++x) {
        const Vector3d centre = voxel * (middle + Vector3d(x, y, z));
        const AlignedBox3d cube(centre.array() - voxel / 2, centre.array() + voxel / 2);
        if (blocks(map.at(centre), unknown)) nearest = std::min(nearest, cube.exteriorDistance(point));
      }
    }
  }
  return nearest;
}

Vector3d along(const std::vector<Vector3d>& path, double length) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double step = (path[i + 1] - path[i]).norm();
    if (length <= step) return path[i] + length / step * (path[i + 1] - path[i]);
    length -= step;
  }
  return path.back();
}

double length_of(const std::vector<Vector3d>& path) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) length += (path[i + 1] - path[i]).norm();
  return length;
}

TEST(Sweep, MeetsWhatASearchOfEveryVoxelAroundEveryPlaceMeets) {
  constexpr double kStep = 0.05;
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const OccupancyMap map = random_map(seed);
    const auto view = MapView::of(map);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 30; ++i) {
      const UnknownSpace unknown = i % 2 == 0 ? UnknownSpace::blocked : UnknownSpace::free;
      const double radius = std::array{0.02, 0.2, 0.45}[static_cast<std::size_t>(i % 3)];
      std::vector<Vector3d> path{random_place(random)};
      for (int k = 0; k < 2; ++k) path.push_back(path.back() + 0.5 * random_place(random));
      const auto hit = view->sweep(path, radius, unknown);
      const double clear = hit ? hit->length : length_of(path);
      for (double s = 0; s < clear - 1e-9; s += kStep)
        ASSERT_GE(nearest_blocked(map, along(path, s), radius, unknown), radius - 1e-9) << seed << ' ' << i;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR((hit->place - along(path, hit->length)).norm(), 0, 1e-9);
      EXPECT_LE(nearest_blocked(map, hit->place, radius, unknown), radius + 1e-9);
      EXPECT_EQ(map.at(hit->voxel), hit->state);
      EXPECT_TRUE(blocks(hit->state, unknown));
      const Vector3d in_segment =
          path[hit->segment] + hit->share * (path[hit->segment + 1] - path[hit->segment]);
      EXPECT_NEAR((hit->place - in_segment).norm(), 0, 1e-9);
    }
  }
  EXPECT_GT(hits, 30U);
}

TEST(Sweep, OfACentreThatPassesACubeIsMetWhereDenseStepsMeetIt) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] {
    const double x = unit(random);
    const double y = unit(random);
    return Vector3d(x, y, unit(random));
  };
  std::size_t contacts = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d corner = vector();
    const AlignedBox3d box(corner, corner.array() + 0.3);
    Vector3d direction = vector();
    if (i % 4 == 0) direction[i / 4 % 3] = 0;
    const BallPath path{vector(), direction.normalized(), 1.5, 0.01 + 0.3 * std::abs(unit(random))};
    const auto contact = path.first_contact(box);
    double dense = std::numeric_limits<double>::infinity();
    for (double s = 0; s <= path.length && !std::isfinite(dense); s += 1e-3)
      if (box.exteriorDistance(path.at(s)) < path.radius) dense = s;
    if (std::isfinite(dense)) {
      ASSERT_TRUE(contact);
      EXPECT_LE(*contact, dense);
      EXPECT_GE(*contact, dense - 1.01e-3);
      ++contacts;
    } else if (contact) {  // between two steps
      EXPECT_NEAR(box.exteriorDistance(path.at(*contact)), path.radius, 1e-9);
      EXPECT_GT(box.exteriorDistance(path.at(*contact + 1e-3)), path.radius - 1e-4);
    }
  }
  EXPECT_GT(contacts, 100U);
}

TEST(Sweep, TakesWhatIsNoPlaceForUnknownAndStopsBeforeIt) {
  const OccupancyMap map = random_map(1);
  const auto view = MapView::of(map);
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
    EXPECT_FALSE(view->sweep({}, 0.3, unknown));
    const std::vector<Vector3d> nowhere{{not_a_number, 0, 0}};
    ASSERT_TRUE(view->sweep(nowhere, 0.3, unknown));
    EXPECT_EQ(view->sweep(nowhere, 0.3, unknown)->state, Occupancy::unknown);
    const std::vector<Vector3d> into_nowhere{{100, 0, 0}, {101, 0, 0}, {not_a_number, 0, 0}};
    ASSERT_TRUE(view->sweep(into_nowhere, 0.3, unknown));
    EXPECT_EQ(view->sweep(into_nowhere, 0.3, unknown)->length, unknown == UnknownSpace::blocked ? 0 : 1);
    const std::vector<Vector3d> very_far{{-1e9, 500, 0}, {1e9, 500, 0}};
    EXPECT_EQ(view->sweep(very_far, 0.3, unknown).has_value(), unknown == UnknownSpace::blocked);
  }
}

TEST(Sweep, NamesTheTimeOfTheHit) {
  Hit hit;
  hit.segment = 1;
  hit.share = 0.25;
  const std::vector<double> times{0, 2, 6};
  EXPECT_DOUBLE_EQ(hit.time(times), 3);
}

TEST(Ray, PassesTheVoxelsThatOctoMapsRayPasses) {
  const OccupancyMap map = random_map(2);
  const auto view = MapView::of(map);
  std::mt19937_64 random(2);
  std::size_t hits = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d from = random_place(random);
    const Vector3d to = random_place(random);
    const double reach = (to - from).norm();
    for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
      const auto hit = view->ray(from, to - from, reach, unknown);
      const double clear = hit ? hit->length : reach;
      for (double s = 0; s < clear - 1e-6; s += 0.02) {
        const Vector3d at = from + s / reach * (to - from);
        ASSERT_FALSE(blocks(map.at(at), unknown)) << i << ' ' << s;
      }
      if (!hit) continue;
      ++hits;
      EXPECT_EQ(map.at(hit->voxel), hit->state);
      EXPECT_TRUE(blocks(hit->state, unknown));
      EXPECT_LE((hit->voxel - hit->place).cwiseAbs().maxCoeff(), 0.05 + 1e-9);
    }
  }
  EXPECT_GT(hits, 300U);
}

TEST(Ray, ThroughTheCornersOfVoxelsEnds) {
  const OccupancyMap map = random_map(3);
  const auto view = MapView::of(map);
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const Vector3d direction(x, y, z);
        const auto hit = view->ray(Vector3d::Zero(), direction, 1000, UnknownSpace::blocked);
        ASSERT_TRUE(hit);
        EXPECT_LT(hit->length, 30);
      }
}

/// From corners, edges and centres of voxels towards others: the voxels whose inside the ray crosses are
/// known by integers alone. Voxels of 1/8 m, so that all places are exact.
TEST(Ray, ThroughCornersAndEdgesMissesNoVoxelThatItCrosses) {
  constexpr double kVoxel = 0.125;
  constexpr double kReach = 12;
  const OccupancyMap map = random_map(9, kVoxel);
  const auto view = MapView::of(map);
  std::mt19937_64 random(9);
  const auto drawn = [&](int least, int most) {
    return std::uniform_int_distribution<int>(least, most)(random);
  };
  std::size_t hits = 0;
  for (int i = 0; i < 4000; ++i) {
    std::array<int, 3> a{}, d{};  // start and direction in half voxels
    for (std::size_t axis = 0; axis < 3; ++axis) {
      a[axis] = drawn(-40, 40);
      d[axis] = drawn(-3, 3);
      if (d[axis] == 0) a[axis] = 2 * (a[axis] / 2) + 1;  // within voxels, and not between two all the way
    }
    const Vector3d start = kVoxel / 2 * Vector3d(a[0], a[1], a[2]);
    const Vector3d direction(d[0], d[1], d[2]);
    if (direction.isZero(0)) continue;
    // Where it passes planes, in sixths of the direction: 6 is a multiple of 1, 2 and 3.
    std::vector<int> planes{0};
    const double per_sixth = kVoxel / 2 * direction.norm() / 6;
    const int end = static_cast<int>(kReach / per_sixth);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int t = 0; d[axis] != 0 && t <= end; ++t)
        if ((6 * a[axis] + t * d[axis]) % 12 == 0) planes.push_back(t);
    std::sort(planes.begin(), planes.end());
    planes.erase(std::unique(planes.begin(), planes.end()), planes.end());
    for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
      double first = std::numeric_limits<double>::infinity();  // at which a voxel is entered that blocks
      for (std::size_t k = 0; k + 1 < planes.size() && !std::isfinite(first); ++k) {
        Vector3d centre;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const int middle = 12 * a[axis] + (planes[k] + planes[k + 1]) * d[axis];  // in 24ths of a voxel
          centre[static_cast<int>(axis)] = kVoxel * (std::floor(middle / 24.0) + 0.5);
        }
        if (blocks(map.at(centre), unknown)) first = planes[k] * per_sixth;
      }
      const auto hit = view->ray(start, direction, kReach, unknown);
      ASSERT_TRUE(hit || !std::isfinite(first)) << start.transpose() << " to " << direction.transpose();
      if (!hit) continue;
      ++hits;
      ASSERT_LE(hit->length, first + 1e-9) << start.transpose() << " to " << direction.transpose();
      // Sooner only where it touches a voxel at a corner or an edge.
      EXPECT_TRUE(blocks(map.at(hit->voxel), unknown));
      EXPECT_LE((hit->voxel - hit->place).cwiseAbs().maxCoeff(), kVoxel / 2 + 1e-9);
      EXPECT_NEAR((hit->place - start - hit->length * direction.normalized()).norm(), 0, 1e-9);
    }
  }
  EXPECT_GT(hits, 2000U);
}

// The paper: "the map's volumetric representation enables the trajectory planner to avoid collisions and
// ignore obstacles outside its planned path".

/// A map with one more obstacle.
OccupancyMap with_obstacle(const OccupancyMap& map, const Vector3d& at) {
  auto tree = map.octree();
  tree->setNodeValue(at.x(), at.y(), at.z(), tree->getClampingThresMaxLog());
  return std::move(OccupancyMap::create({}, std::move(tree))).value();
}

TEST(Sweep, IgnoresAnObstacleOutsideTheCorridorAndFindsOneInsideAtTheRightPlace) {
  const OccupancyMap map = random_map(4);
  const auto view = MapView::of(map);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  constexpr double kRadius = 0.3;
  std::size_t outside = 0;
  std::size_t inside = 0;
  for (int i = 0; i < 40; ++i) {
    const std::vector<Vector3d> path{random_place(random), random_place(random)};
    const double length = length_of(path);
    const Vector3d offset = 0.5 * Vector3d(unit(random), unit(random), unit(random));
    const Vector3d at = along(path, 0.5 * (1 + unit(random)) * length) + offset;
    const Vector3d centre = 0.1 * ((at.array() / 0.1).floor() + 0.5);
    const AlignedBox3d cube(centre.array() - 0.05, centre.array() + 0.05);
    double contact = std::numeric_limits<double>::infinity();  // in dense steps
    for (double s = 0; s <= length && !std::isfinite(contact); s += 1e-3)
      if (cube.exteriorDistance(along(path, s)) < kRadius) contact = s;
    const auto changed = MapView::of(with_obstacle(map, centre));
    for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
      const auto before = view->sweep(path, kRadius, unknown);
      const auto after = changed->sweep(path, kRadius, unknown);
      if (!std::isfinite(contact)) {
        ++outside;
        ASSERT_EQ(after.has_value(), before.has_value());
        if (after) {
          EXPECT_NEAR(after->length, before->length, 1e-3);
        }
      } else {
        ++inside;
        ASSERT_TRUE(after);
        const double expected = std::min(contact, before ? before->length : contact);
        EXPECT_NEAR(after->length, expected, 1.1e-3);
        if (!before || contact < before->length - 2e-3) {
          EXPECT_EQ(after->state, Occupancy::occupied);
        }
      }
    }
  }
  EXPECT_GT(outside, 15U);
  EXPECT_GT(inside, 15U);
}

TEST(Sweep, IsNeverWorseForSpaceThatHasBecomeKnownAsFree) {
  const OccupancyMap map = random_map(8);
  const auto view = MapView::of(map);
  std::mt19937_64 random(8);
  for (int i = 0; i < 60; ++i) {
    const std::vector<Vector3d> path{random_place(random), random_place(random)};
    const std::vector<Vector3d> seen{random_place(random), random_place(random)};
    const auto more = view->flown(seen, 1);
    const auto before = view->sweep(path, 0.3, UnknownSpace::blocked);
    const auto after = more->sweep(path, 0.3, UnknownSpace::blocked);
    if (after) {
      ASSERT_TRUE(before);
      EXPECT_GE(after->length, before->length);
    }
  }
}

}  // namespace
}  // namespace pade::mapping
