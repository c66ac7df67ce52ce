#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

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
  using K = OpenWorldKind;
  // The first four had a stone there.
  for (const auto& [kind, seed] :
       {std::pair{K::rubble, 108}, std::pair{K::forest, 114}, std::pair{K::rubble, 120},
        std::pair{K::building_site, 130}, std::pair{K::street, 101}}) {
    const OpenWorld made = generate_open_world(kind, static_cast<std::uint64_t>(seed), 400);
    ASSERT_TRUE(write_world(made.files, folder / "world.sdf").ok());
    auto world = read_sdf(folder / "world.sdf");
    ASSERT_TRUE(world.ok());
    const Things things = things_of(std::move(world).value());
    for (double climb = 0; climb <= 1.2; climb += 0.3)
      EXPECT_GT(things.surface.to(made.start - climb * Vector3d::UnitZ()), 1.5)
          << to_name(kind) << " " << seed;
    EXPECT_GT(things.surface.to(made.goal), 1.5) << to_name(kind) << " " << seed;
  }
  fs::remove_all(folder);
}

/// The same by the files, for many seeds.
TEST(OpenWorld, NoStoneReachesIntoTheRoomAboutStartAndGoal) {
  constexpr double kReach = 0.6;  // of the mesh, at size 1
  int stones = 0;
  for (const auto& [kind, name] : EnumNames<OpenWorldKind>::names) {
    for (std::uint64_t seed = 101; seed <= 140; ++seed) {
      const OpenWorld made = generate_open_world(kind, seed, 400);
      const std::string& text = made.files.sdf;
      for (auto at = text.find("meshes/stone"); at != std::string::npos;
           at = text.find("meshes/stone", at + 1)) {
        const char* const pose = text.c_str() + text.rfind("<pose>", at) + 6;
        const char* const size = text.c_str() + text.find("<scale>", at) + 7;
        char* next = nullptr;
        const double x = std::strtod(pose, &next);
        const double y = std::strtod(next, nullptr);
        const double reach = kReach * std::strtod(size, nullptr);
        ++stones;
        EXPECT_GT(std::hypot(x, y) - reach, 2.4) << name << " " << seed;
        EXPECT_GT(std::hypot(x - 60, y) - reach, 1.9) << name << " " << seed;
      }
    }
  }
  EXPECT_GT(stones, 10000);
}

/// Wires end up to 1.5 m from where they begin.
TEST(OpenWorld, NoWireOfAStreetHangsAboutTheGoal) {
  int wires = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const std::string text = generate_open_world(OpenWorldKind::street, seed, 100).files.sdf;
    const auto from = text.find("name=\"wires_");
    ASSERT_NE(from, std::string::npos);
    for (auto at = text.find("<pose>", from); at != std::string::npos; at = text.find("<pose>", at + 1)) {
      double pose[6] = {};
      const char* next = text.c_str() + at + 6;
      for (double& value : pose) {
        char* end = nullptr;
        value = std::strtod(next, &end);
        next = end;
      }
      const double length = std::strtod(text.c_str() + text.find("<length>", at) + 8, nullptr);
      const double half = 0.5 * length * std::abs(std::sin(pose[4]) * std::cos(pose[5]));
      ++wires;
      EXPECT_LT(pose[0] + half, 58) << seed;
    }
  }
  EXPECT_GT(wires, 2000);
}

/// Two processes that look for the same world must not write one attempt over another.
TEST(OpenWorld, EachAttemptHasAFileOfItsOwn) {
  const fs::path folder = fs::temp_directory_path() / "pade_open_world_attempts_test";
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const fs::path file = folder / std::to_string(seed) / "rubble.sdf";
    const auto found = find_open_world(OpenWorldKind::rubble, seed, 1500, file);
    ASSERT_TRUE(found.ok()) << found.error().message;
    std::ifstream stream(file);
    const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    EXPECT_EQ(text, generate_open_world(OpenWorldKind::rubble, seed, 1500, 0).files.sdf) << "the first stays";
    if (*found) {
      EXPECT_EQ((*found)->file == file, (*found)->attempt == 0);
      EXPECT_TRUE(fs::exists((*found)->file));
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pade::simulation
