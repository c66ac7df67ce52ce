#include "pade/simulation/render/sun_map.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/simulation/generator/open_world.hpp"
#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
namespace fs = std::filesystem;

struct Tally {
  int points = 0;          ///< that face the sun
  int lit = 0;             ///< by the rays
  int unknown = 0;         ///< to the map
  int different = 0;       ///< where the two do not agree
  int contradictions = 0;  ///< more than a millimetre from the edge of a shadow
};

/// Whether a ray toward the sun from there meets nothing.
bool lit(const Scene& scene, const Vector3d& from, const Vector3d& to_sun) {
  RayPacket rays{};
  rays.set(0, from, to_sun, 1e-4F, std::numeric_limits<float>::infinity());
  return !scene.occluded(rays, Scene::Blockers::shadow_casters)[0];
}

/// Within a millimetre of the edge of a shadow.
bool on_edge(const Scene& scene, const Vector3d& from, const Vector3d& to_sun) {
  const Vector3d x = 1e-3 * to_sun.unitOrthogonal();
  const Vector3d y = to_sun.cross(x);
  int count = 0;
  for (const Vector3d& step : {x, y, Vector3d(-x), Vector3d(-y)})
    count += static_cast<int>(lit(scene, from + step, to_sun));
  return count > 0 && count < 4;
}

/// Every second pixel of a picture both ways, just before its surface as the renderer asks.
Tally compare(const Scene& scene, const Vector3d& to_sun, const Pose& T_world_camera) {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 220;
  camera.cx = 159.5;
  camera.cy = 119.5;
  const RayGrid grid(camera);
  const VisibleSurface seen = visible_surface(scene, grid, T_world_camera);
  const SunMap map(scene.geometry(), to_sun);
  Tally tally;
  for (int v = 0; v < camera.height; v += 2) {
    for (int u = 0; u < camera.width; u += 2) {
      const Primitive primitive{static_cast<std::uint32_t>(seen.primitive.at<std::int32_t>(v, u))};
      if (!primitive.hit()) continue;
      const Vector3d direction =
          T_world_camera.rotation * Vector3d(grid.ray(u, v).x(), grid.ray(u, v).y(), 1);
      const auto depth = static_cast<double>(seen.depth.at<float>(v, u));
      const Vector3d at = T_world_camera.translation + depth * direction;
      if (scene.surface(primitive, at, direction, false).normal.cast<double>().dot(to_sun) <= 0) continue;
      const Vector3d from = T_world_camera.translation + (1 - 3e-4) * depth * direction;
      const bool shines = lit(scene, from, to_sun);
      const SunMap::Sun sun = map.at(from, scene.surface_id(primitive));
      ++tally.points;
      tally.lit += static_cast<int>(shines);
      tally.unknown += static_cast<int>(sun == SunMap::Sun::unknown);
      const bool differs = sun == (shines ? SunMap::Sun::hidden : SunMap::Sun::shines);
      tally.different += static_cast<int>(differs);
      tally.contradictions += static_cast<int>(differs && !on_edge(scene, from, to_sun));
    }
  }
  return tally;
}

Pose looking(double yaw, const Vector3d& position) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())) *
              Eigen::Quaterniond(forward_camera_rotation()),
          position};
}

Vector3d sun_at(double elevation, double azimuth) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

TEST(SunMap, FindsTheShadowsOfOpenWorldsThatRaysFind) {
  Random random(5);
  Tally all;
  const fs::path folder = fs::temp_directory_path() / "pade_sun_map_test";
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names) {
    const OpenWorld made = generate_open_world(kind, 3, 200);
    ASSERT_TRUE(write_world(made.files, folder / "world.sdf").ok());
    auto world = read_sdf(folder / "world.sdf");
    ASSERT_TRUE(world.ok()) << world.error().message;
    const auto scene = Scene::build(std::move(world).value());
    ASSERT_TRUE(scene.ok());
    for (const double elevation : {0.17, 0.6, 1.2}) {
      const Tally tally =
          compare(*scene, sun_at(elevation, random.uniform(-3, 3)),
                  looking(random.uniform(-1, 1), {random.uniform(0, 40), random.uniform(-5, 5), 1.8}));
      EXPECT_EQ(tally.contradictions, 0) << name << ' ' << elevation;
      all.points += tally.points;
      all.lit += tally.lit;
      all.unknown += tally.unknown;
      all.different += tally.different;
    }
  }
  fs::remove_all(folder);
  EXPECT_GT(all.lit, all.points / 4);
  EXPECT_GT(all.points - all.lit, all.points / 4);
  EXPECT_LT(all.unknown, all.points / 10);
  EXPECT_LT(all.different, all.points / 10000);
}

TEST(SunMap, KnowsNoShadowsOfTheFlatAndTheTerminatorOfTheRound) {
  World world;
  const auto place = [&](const Shape& shape, const Vector3d& at, const Vector3d& turn, bool casts = true) {
    world.visuals.push_back({"shape", {rotation_exp(turn), at}, shape, {}, casts});
  };
  Random random(9);
  place(Rectangle{{0, 0, 1}, {500, 500}}, {0, 0, 0}, {0, 0, 0});
  for (int i = 0; i < 30; ++i) {
    const Vector3d at(random.uniform(3, 25), random.uniform(-9, 9), random.uniform(0.2, 3));
    const Vector3d turn(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
    switch (i % 5) {
      case 0:
        place(Ellipsoid{{random.uniform(0.1, 1), 0.4, random.uniform(0.1, 1.5)}}, at, turn);
        break;
      case 1:
        place(Cylinder{random.uniform(0.05, 0.4), random.uniform(0.3, 5)}, at, turn);
        break;
      case 2:
        place(Capsule{0.2, random.uniform(0.3, 3)}, at, turn);
        break;
      case 3:
        place(Box{{random.uniform(0.1, 2), 0.5, random.uniform(0.1, 4)}}, at, turn);
        break;
      default:
        place(Ellipsoid{{0.5, 0.5, 0.5}}, at, turn, false);
        break;
    }
  }
  const auto scene = Scene::build(std::move(world));
  ASSERT_TRUE(scene.ok());
  int unknown = 0;
  int points = 0;
  for (int i = 0; i < 12; ++i) {
    const Tally tally =
        compare(*scene, sun_at(random.uniform(0.1, 1.5), random.uniform(-3, 3)),
                looking(random.uniform(-0.5, 0.5), {random.uniform(-4, 2), random.uniform(-4, 4), 1.5}));
    EXPECT_EQ(tally.contradictions, 0) << i;
    unknown += tally.unknown;
    points += tally.points;
  }
  EXPECT_LT(unknown, points / 3);
}

}  // namespace
}  // namespace pade::simulation
