#include "pade/simulation/world/world_fingerprint.hpp"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace pade::simulation {
namespace {

std::shared_ptr<const TriangleMesh> triangle_of(double size) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}};
  mesh.triangles = {{0, 1, 2}};
  return std::make_shared<const TriangleMesh>(mesh);
}

World of_meshes(const std::vector<std::shared_ptr<const TriangleMesh>>& meshes) {
  World world;
  for (const auto& mesh : meshes) world.visuals.push_back({"v", {}, Mesh{mesh, {1, 1, 1}}, {}, true});
  return world;
}

World of_images(const std::vector<std::shared_ptr<const cv::Mat>>& images) {
  World world;
  for (const auto& image : images) {
    world.visuals.push_back({"v", {}, Box{}, {}, true});
    world.visuals.back().material.image = image;
  }
  return world;
}

TEST(WorldFingerprint, TellsWhichOfTheMeshesStandsWhere) {
  const auto a = triangle_of(1);
  const auto b = triangle_of(2);
  EXPECT_NE(world_fingerprint(of_meshes({a, b, a})), world_fingerprint(of_meshes({a, b, b})));
  EXPECT_EQ(world_fingerprint(of_meshes({a, b, a})), world_fingerprint(of_meshes({a, b, a})));
}

TEST(WorldFingerprint, TellsWhichOfTheImagesIsShownWhere) {
  const auto filled = [](int rows, int columns, double value) {
    return std::make_shared<const cv::Mat>(rows, columns, CV_8UC3, cv::Scalar::all(value));
  };
  const auto a = filled(4, 4, 10);
  const auto b = filled(4, 4, 20);
  EXPECT_NE(world_fingerprint(of_images({a, b, a})), world_fingerprint(of_images({a, b, b})));
  EXPECT_NE(world_fingerprint(of_images({a, b, nullptr})), world_fingerprint(of_images({a, b, a})));
  EXPECT_NE(world_fingerprint(of_images({filled(2, 8, 10)})),
            world_fingerprint(of_images({filled(8, 2, 10)})));
}

}  // namespace
}  // namespace pade::simulation
