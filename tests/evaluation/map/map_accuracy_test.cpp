#include "pade/evaluation/map/map_accuracy.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "pade/evaluation/map/map_ceiling.hpp"
#include "pade/evaluation/map/rigid_alignment.hpp"
#include "pade/evaluation/map/view_ahead.hpp"

namespace pade::evaluation {
namespace {

using Eigen::Vector3d;
using mapping::OccupancyMap;

constexpr double kSide = 0.1;
constexpr double kWall = 3.03;  // metres ahead of the origin along x

Camera small_camera() {
  Camera camera;
  camera.width = 80;
  camera.height = 60;
  camera.fx = camera.fy = 70;
  camera.cx = 39.5;
  camera.cy = 29.5;
  return camera;
}

Pose looking_along_x(const Vector3d& position = Vector3d::Zero()) {
  return {Eigen::Quaterniond(forward_camera_rotation()), position};
}

/// A square wall across x.
Surface wall_at(double x, double half = 50) {
  const Vector3d a(x, -half, -half);
  const Vector3d b(x, half, -half);
  const Vector3d c(x, half, half);
  const Vector3d d(x, -half, half);
  return Surface({{a, b, c}, {a, c, d}});
}

cv::Mat flat_depth(double z) { return cv::Mat(60, 80, CV_32FC1, cv::Scalar(z)); }

/// A map in which the boxes that `state` names are occupied (+1), free (-1) or unknown (0), within the
/// bounds.
template <class State>
OccupancyMap map_of(const Eigen::AlignedBox3d& bounds, const State& state) {
  auto tree = std::make_unique<octomap::OcTree>(kSide);
  const Voxel low = voxel_at(bounds.min(), kSide);
  const Voxel high = voxel_at(bounds.max(), kSide);
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const Vector3d p = centre_of({x, y, z}, kSide);
        const int s = state(p);
        if (s != 0) tree->setNodeValue(p.x(), p.y(), p.z(), s > 0 ? 2.0F : -2.0F, true);
      }
    }
  }
  tree->updateInnerOccupancy();
  tree->prune();
  auto map = OccupancyMap::create({}, std::move(tree));
  EXPECT_TRUE(map.ok());
  return std::move(map).value();
}

const Eigen::AlignedBox3d kRoom(Vector3d(-0.5, -3, -3), Vector3d(8, 3, 3));

TEST(Voxels, BelongToTheUpperNeighbourOnTheirFaces) {
  for (int i = -40; i < 40; ++i) EXPECT_EQ(voxel_at(Vector3d(i / 10.0, 0, 0), 0.1)[0], i);
  EXPECT_EQ(voxel_at({-0.05, 0.05, 0.15}, 0.1), (Voxel{-1, 0, 1}));
  EXPECT_TRUE(box_of({3, 0, 0}, 0.1).contains(Vector3d(0.3, 0.05, 0.05)));
}

/// The voxels of the wall in which a pixel's ray ends: counted by hand.
TEST(SeenSurface, OfAWallIsOneLayerOfVoxels) {
  const Camera camera = small_camera();
  SeenSurface seen(kSide, 8);
  seen.add(flat_depth(kWall), camera, looking_along_x());
  const Surface surface = wall_at(kWall);
  const std::vector<Voxel> voxels = seen.voxels(PlacedSurface(surface));
  // Rays end at y = (39.5 - u) / 70 * 3.03 and z = (29.5 - v) / 70 * 3.03: 4.3 cm apart, none is left out.
  const double y = 39.5 / 70 * kWall;
  const double z = 29.5 / 70 * kWall;
  const int wide = static_cast<int>(std::floor((y + 0.001) / kSide) - std::floor((-y - 0.001) / kSide)) + 1;
  const int high = static_cast<int>(std::floor((z + 0.001) / kSide) - std::floor((-z - 0.001) / kSide)) + 1;
  EXPECT_EQ(voxels.size(), static_cast<std::size_t>(wide * high));
  for (const Voxel& voxel : voxels) EXPECT_EQ(voxel[0], 30);
}

/// The far side of a board of 6 cm lies in the next voxel, and nobody sees it.
TEST(SeenSurface, HasNothingThatIsHidden) {
  SeenSurface seen(kSide, 8);
  seen.add(flat_depth(2.97), small_camera(), looking_along_x());
  const Surface far_side = wall_at(3.03);
  EXPECT_TRUE(seen.voxels(PlacedSurface(far_side)).empty());
  const Surface near_side = wall_at(2.97);
  EXPECT_FALSE(seen.voxels(PlacedSurface(near_side)).empty());
}

TEST(SeenSurface, EndsAtItsDepthAndHasNoNaN) {
  SeenSurface seen(kSide, 8);
  seen.add(flat_depth(8.1), small_camera(), looking_along_x());
  seen.add(flat_depth(std::numeric_limits<double>::quiet_NaN()), small_camera(), looking_along_x());
  const Surface surface = wall_at(8.1);
  EXPECT_TRUE(seen.voxels(PlacedSurface(surface)).empty());
}

TEST(SurfaceShares, AreThoseOfAKnownMap) {
  const Surface surface = wall_at(kWall);
  SeenSurface seen(kSide, 8);
  seen.add(flat_depth(kWall), small_camera(), looking_along_x());
  const std::vector<Voxel> voxels = seen.voxels(PlacedSurface(surface));
  // Occupied left of y = 0, free up to y = 0.5, unknown beyond.
  const OccupancyMap map = map_of(kRoom, [](const Vector3d& p) {
    if (p.x() < 3 || p.x() > 3.1 || p.y() > 0.5) return 0;
    return p.y() < 0 ? 1 : -1;
  });
  SurfaceShares expected;
  for (const Voxel& voxel : voxels) {
    ++expected.voxels;
    if (voxel[1] < 0) ++expected.occupied;
    if (voxel[1] >= 0 && voxel[1] < 5) ++expected.free;
    if (voxel[1] >= 5) ++expected.unknown;
    if (voxel[1] < 1) ++expected.occupied_or_neighbour;
  }
  const SurfaceShares found = surface_shares(map, voxels, PlacedSurface(surface));
  EXPECT_GT(expected.free, 0U);
  EXPECT_EQ(found.voxels, expected.voxels);
  EXPECT_EQ(found.occupied, expected.occupied);
  EXPECT_EQ(found.free, expected.free);
  EXPECT_EQ(found.unknown, expected.unknown);
  EXPECT_EQ(found.occupied_or_neighbour, expected.occupied_or_neighbour);
}

/// A wall on the face between two layers may be in either; free it is only where both are.
TEST(SurfaceShares, OfAWallOnAFaceAreThoseOfBothLayers) {
  const Surface surface = wall_at(3);
  SeenSurface seen(kSide, 8);
  seen.add(flat_depth(3), small_camera(), looking_along_x());
  const std::vector<Voxel> voxels = seen.voxels(PlacedSurface(surface));
  const auto shares = [&](int before, int behind) {
    const OccupancyMap map = map_of(kRoom, [&](const Vector3d& p) { return p.x() < 3 ? before : behind; });
    return surface_shares(map, voxels, PlacedSurface(surface));
  };
  EXPECT_GT(voxels.size(), 100U);
  EXPECT_EQ(shares(1, -1).occupied, voxels.size());
  EXPECT_EQ(shares(-1, 1).occupied, voxels.size());
  EXPECT_EQ(shares(-1, -1).free, voxels.size());
  EXPECT_EQ(shares(-1, 0).unknown, voxels.size());
  EXPECT_EQ(shares(0, -1).unknown, voxels.size());
}

TEST(Phantoms, AreCountedByTheDistanceOfTheBox) {
  const Surface surface = wall_at(kWall);
  // Layers of 60 x 60 voxels; the near face of layer x lies x - 3.03 behind the wall.
  const std::set<int> layers = {30, 31, 32, 33, 40};
  const OccupancyMap map =
      map_of(Eigen::AlignedBox3d(Vector3d(2.95, -2.95, -2.95), Vector3d(4.05, 2.95, 2.95)),
             [&](const Vector3d& p) { return layers.contains(voxel_at(p, kSide)[0]) ? 1 : 0; });
  const Phantoms found = phantoms(map, PlacedSurface(surface));
  EXPECT_EQ(found.occupied, 5U * 60 * 60);
  EXPECT_EQ(found.farther[0], 3U * 60 * 60);  // 0.17, 0.27 and 0.97
  EXPECT_EQ(found.farther[1], 1U * 60 * 60);
  EXPECT_EQ(found.farther[2], 1U * 60 * 60);
}

TEST(Phantoms, CountEveryVoxelOfAPrunedCube) {
  const Surface surface = wall_at(-5);
  const OccupancyMap map =
      map_of({Vector3d(0.05, 0.05, 0.05), Vector3d(1.55, 1.55, 1.55)}, [](const Vector3d&) { return 1; });
  EXPECT_EQ(map.occupied().size(), 1U);
  const Phantoms found = phantoms(map, PlacedSurface(surface));
  EXPECT_EQ(found.occupied, 16U * 16 * 16);
  EXPECT_EQ(found.farther[2], 16U * 16 * 16);
}

/// What holds of a map holds of the same map turned with its world, but for voxels on edges.
TEST(Phantoms, FollowTheAlignment) {
  const Pose T_map_world{rotation_exp({0, 0, 0.3}), {1, 2, 0}};
  const Surface surface = wall_at(kWall, 2);
  const PlacedSurface placed(surface, T_map_world);
  const OccupancyMap map = map_of({Vector3d(0, 0, -2), Vector3d(6, 6, 2)}, [&](const Vector3d& p) {
    const Vector3d world = T_map_world.inverse() * p;
    return std::abs(world.x() - kWall) < 0.05 && world.tail<2>().cwiseAbs().maxCoeff() < 1.9 ? 1 : 0;
  });
  const Phantoms found = phantoms(map, placed);
  EXPECT_GT(found.occupied, 1000U);
  EXPECT_EQ(found.farther[0], 0U);
  EXPECT_EQ(phantoms(map, PlacedSurface(surface)).farther[2], found.occupied);
}

TEST(AheadShares, AreThoseWithinTheCone) {
  const Camera camera = small_camera();
  // The wall is occupied only 1.05 m and more left of the axis, outside of the cone of 6 degrees (0.32 m).
  const auto wall = [](double from) {
    return [from](const Vector3d& p) { return p.x() > 3 && p.x() < 3.1 && p.y() > from ? 1 : -1; };
  };
  const Vector3d forward(0, 0, 1);
  const AheadShares off =
      ahead_shares(map_of(kRoom, wall(1.05)), flat_depth(kWall), camera, looking_along_x(), forward);
  EXPECT_GT(off.points, 100U);
  EXPECT_EQ(off.occupied_near, 0U);
  EXPECT_EQ(off.free, off.points);
  const AheadShares on =
      ahead_shares(map_of(kRoom, wall(-9)), flat_depth(kWall), camera, looking_along_x(), forward);
  EXPECT_EQ(on.occupied_near, on.points);
  EXPECT_EQ(on.occupied, on.points);
  // To the left, at tan = 1.05 / 3.03 and beyond, is where the first map has it.
  const AheadShares left = ahead_shares(map_of(kRoom, wall(1.05)), flat_depth(kWall), camera,
                                        looking_along_x(), Vector3d(-0.51, 0, 1));
  EXPECT_EQ(left.occupied_near, left.points);
}

class Ahead : public ::testing::Test {
 protected:
  ViewAheadResult ask(const OccupancyMap& map) const {
    ViewAhead ahead(world_);
    ahead.add(map, looking_along_x(), looking_along_x(), Vector3d(0, 0, 1), flat_depth(kWall),
              small_camera());
    return ahead.result();
  }
  static const Shell& shell(const ViewAheadResult& result, int from) {
    return result.shells[static_cast<std::size_t>(from - 1)];
  }

  TrueWorld world_{wall_at(kWall), [](const Vector3d& p) { return p.x() > kWall; }};
};

TEST_F(Ahead, AFreeMapIsFreeUpToTheWall) {
  const OccupancyMap map = map_of(kRoom, [](const Vector3d& p) { return p.x() < 3 ? -1 : 0; });
  const ViewAheadResult found = ask(map);
  EXPECT_EQ(shell(found, 2).frames, 1U);
  EXPECT_EQ(shell(found, 2).known_free, 1);
  EXPECT_EQ(shell(found, 3).frames, 0U);  // 3 to 4 m: behind the wall
  EXPECT_EQ(shell(found, 5).frames, 0U);
  // The sphere meets the wall at 3.03 - 0.35, and the unknown voxels at 3 - 0.35.
  EXPECT_NEAR(found.reach.median, 2.65, 0.051);
  EXPECT_NEAR(found.reach.true_median, 2.68, 0.051);
  EXPECT_EQ(found.reach.past_surface, 0U);
}

TEST_F(Ahead, HalfAFreeCorridorIsHalf) {
  const OccupancyMap map = map_of(kRoom, [](const Vector3d& p) { return p.y() < 0 ? -1 : 0; });
  const ViewAheadResult found = ask(map);
  EXPECT_NEAR(shell(found, 1).known_free, 0.5, 1e-12);
  EXPECT_EQ(shell(found, 1).called_occupied, 0);
  EXPECT_EQ(found.reach.median, 0);
}

TEST_F(Ahead, AMapThatIsFreeThroughAWallIsSaidToBe) {
  const OccupancyMap map = map_of(kRoom, [](const Vector3d&) { return -1; });
  const ViewAheadResult found = ask(map);
  EXPECT_EQ(found.reach.past_surface, 1U);
  EXPECT_LE(found.reach.median, 2.68);
}

TEST_F(Ahead, AnUnknownVoxelInTheWayStopsTheSphere) {
  const OccupancyMap map = map_of(
      kRoom, [](const Vector3d& p) { return (p - Vector3d(2.05, 0.25, 0.05)).norm() < 0.01 ? 0 : -1; });
  // Its box begins at x = 2, y = 0.2: sqrt(0.35^2 - 0.2^2) before.
  EXPECT_NEAR(ask(map).reach.median, 2 - std::sqrt(0.35 * 0.35 - 0.2 * 0.2), 0.051);
}

TEST_F(Ahead, WithoutSolidsWhatLiesBehindAWallIsNeverAsked) {
  world_.inside_solid = nullptr;
  const ViewAheadResult found = ask(map_of(kRoom, [](const Vector3d&) { return -1; }));
  EXPECT_EQ(shell(found, 4).frames, 0U);
}

/// Poses of the run that lie elsewhere than the true ones: truth goes with the camera.
TEST_F(Ahead, LaysTruthOverTheMapCameraOnCamera) {
  const Pose T_map_world{rotation_exp({0, 0, 1.2}), {3, -1, 0.5}};
  const OccupancyMap map = map_of({Vector3d(-3, -3, -4), Vector3d(9, 9, 4)}, [&](const Vector3d& p) {
    return (T_map_world.inverse() * p).x() < 2.9 ? -1 : 0;
  });
  ViewAhead ahead(world_);
  ahead.add(map, T_map_world * looking_along_x(), looking_along_x(), Vector3d(0, 0, 1), cv::Mat(),
            small_camera());
  const ViewAheadResult found = ahead.result();
  EXPECT_EQ(shell(found, 1).known_free, 1);
  EXPECT_EQ(shell(found, 2).frames, 1U);
  EXPECT_NEAR(found.reach.true_median, 2.68, 0.051);
}

TEST(MapCeiling, PutsAWallWhereItIs) {
  auto ceiling = MapCeiling::create({});
  ASSERT_TRUE(ceiling.ok());
  const Camera camera = small_camera();
  ceiling->add(flat_depth(kWall), camera, looking_along_x());
  const auto map = ceiling->finish();
  ASSERT_TRUE(map.ok());
  EXPECT_EQ(map->at({3.05, 0.05, 0.05}), mapping::Occupancy::occupied);
  EXPECT_EQ(map->at({1.55, 0.05, 0.05}), mapping::Occupancy::free);
  const Surface surface = wall_at(kWall);
  EXPECT_EQ(phantoms(*map, PlacedSurface(surface)).farther[0], 0U);
}

}  // namespace
}  // namespace pade::evaluation
