// The worlds that the program ships, with the flights that go with them, at a small size.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "pade/simulation/flight/simulated_sequence.hpp"
#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;

class ShippedWorld : public testing::TestWithParam<WorldKind> {};

TEST_P(ShippedWorld, ReadsWithoutAWarningAndIsFlown) {
  const std::string name(to_name(GetParam()));
  const fs::path source(PADE_SOURCE_DIR);
  auto world = read_sdf(source / "worlds" / name / (name + ".sdf"));
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_THAT(world->warnings, testing::IsEmpty());
  const auto scene = Scene::build(std::move(world).value());
  ASSERT_TRUE(scene.ok());
  auto flight = read_flight(source / "config/flights" / (name + ".yaml"));
  ASSERT_TRUE(flight.ok()) << flight.error().message;
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 138.6;
  camera.cx = 79.5;
  camera.cy = 59.5;
  flight->camera = camera;
  SequenceOptions options;
  options.render = RenderOptions::preview();
  options.every = 20;
  const fs::path out =
      fs::temp_directory_path() / ("pade_shipped_" + std::to_string(::getpid()) + "_" + name);
  const Status status = write_sequence(*scene, *flight, out, options);
  EXPECT_TRUE(status.ok()) << status.error().message;
  fs::remove_all(out);
}

std::string world_name(const testing::TestParamInfo<WorldKind>& kind) {
  return std::string(to_name(kind.param));
}

INSTANTIATE_TEST_SUITE_P(Worlds, ShippedWorld,
                         testing::Values(WorldKind::building, WorldKind::street, WorldKind::forest,
                                         WorldKind::rubble, WorldKind::corridor),
                         world_name);

}  // namespace
}  // namespace pade::simulation
