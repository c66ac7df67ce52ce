#include <filesystem>

#include <gtest/gtest.h>

#include "pade/simulation/generator/open_world_scene.hpp"
#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
namespace fs = std::filesystem;

/// A room of 20 m x 8 m x 3 m with a wall across, which has a gap of this width.
Scene with_gap(double gap) {
  World world;
  const auto wall = [&](const Vector3d& centre, const Vector3d& size) {
    world.visuals.push_back({"wall", {Eigen::Quaterniond::Identity(), centre}, Box{size}, {}, true});
  };
  const double piece = 0.5 * (8 - gap);
  wall({10, -4 + 0.5 * piece, 1.5}, {0.2, piece, 3});
  wall({10, 4 - 0.5 * piece, 1.5}, {0.2, piece, 3});
  wall({10, -4, 1.5}, {24, 0.1, 3});
  wall({10, 4, 1.5}, {24, 0.1, 3});
  return std::move(Scene::build(std::move(world))).value();
}

TEST(OpenWorld, APassageIsFoundWhereTheBallFits) {
  for (const double gap : {0.6, 0.95, 1.4, 3.0}) {
    const Scene scene = with_gap(gap);
    const auto surface = SurfaceDistance::build(scene);
    ASSERT_TRUE(surface.ok());
    PassageOptions options;
    options.half_width = 3.8;
    options.highest = 2.4;
    EXPECT_EQ(is_passable(*surface, {0, 0, 1.5}, {20, 0, 1.5}, options), gap > 1.2) << gap;
  }
}

TEST(OpenWorld, TheSeedDecidesTheFilesAndTheDensityHowManyThingsStand) {
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names) {
    const OpenWorld a = generate_open_world(kind, 3, 200);
    EXPECT_EQ(a.files.sdf, generate_open_world(kind, 3, 200).files.sdf) << name;
    EXPECT_NE(a.files.sdf, generate_open_world(kind, 4, 200).files.sdf) << name;
    EXPECT_NE(a.files.sdf, generate_open_world(kind, 3, 200, 1).files.sdf) << name;
    EXPECT_GT(generate_open_world(kind, 3, 800).files.sdf.size(), a.files.sdf.size() + 10000) << name;
    EXPECT_EQ((a.goal - a.start).norm(), 60);
  }
}

TEST(OpenWorld, StartAndGoalAreFreeAndThereIsAWay) {
  const fs::path folder = fs::temp_directory_path() / "pade_open_world_test";
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names) {
    const auto world = make_open_world(kind, 2, 60, folder / "world.sdf");
    ASSERT_TRUE(world.ok()) << name << ": " << world.error().message;
    EXPECT_GT(world->surface.to(world->start), 1.2) << name;  // of the ground too
    EXPECT_GT(world->surface.to(world->goal), 1.2) << name;
    EXPECT_TRUE(world->scene.world().warnings.empty()) << name;
  }
  EXPECT_FALSE(make_open_world(OpenWorldKind::forest, 2, 5, folder / "world.sdf").ok());
  fs::remove_all(folder);
}

struct Things {
  Scene scene;
  SurfaceDistance surface;
};

/// What stands in a world or lies about in it: all but the ground.
Things things_of(World world) {
  std::erase_if(world.visuals,
                [](const Visual& visual) { return std::holds_alternative<Rectangle>(visual.shape); });
  auto scene = Scene::build(std::move(world));
  EXPECT_TRUE(scene.ok());
  auto surface = SurfaceDistance::build(*scene);
  EXPECT_TRUE(surface.ok());
  return {std::move(scene).value(), std::move(surface).value()};
}

/// The climb begins 0.4 m above the ground, where a loose stone is in the way of the vehicle, and the planner
/// takes it that 1.5 m about the climb are free.
TEST(OpenWorld, NothingLiesWhereAFlightBeginsAndEnds) {
  const fs::path folder = fs::temp_directory_path() / "pade_open_world_room_test";
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names) {
    for (std::uint64_t seed = 101; seed <= 140; ++seed) {
      const OpenWorld made = generate_open_world(kind, seed, 400);
      ASSERT_TRUE(write_world(made.files, folder / "world.sdf").ok());
      auto world = read_sdf(folder / "world.sdf");
      ASSERT_TRUE(world.ok());
      const Things things = things_of(std::move(world).value());
      for (double climb = 0; climb <= 1.2; climb += 0.3)
        EXPECT_GT(things.surface.to(made.start - climb * Vector3d::UnitZ()), 1.5) << name << " " << seed;
      EXPECT_GT(things.surface.to(made.goal), 1.5) << name << " " << seed;
      EXPECT_GT(things.surface.to(made.goal - 1.2 * Vector3d::UnitZ()), 1.5) << name << " " << seed;
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pade::simulation
