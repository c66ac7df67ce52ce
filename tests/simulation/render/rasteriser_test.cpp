// The rasteriser against rays: both must see the same surface everywhere, but for pixels that lie within
// rounding of an outline, where a ray beside them must see what was drawn.
#include "pade/simulation/render/raster/rasteriser.hpp"

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/simulation/render/truth.hpp"

#include "support/nan.hpp"

namespace pade::simulation {
namespace {

Camera small_camera() {
  Camera camera;
  camera.width = 333;  // neither whole blocks nor whole tiles
  camera.height = 150;
  camera.fx = 170;
  camera.fy = 165;
  camera.cx = 160.3;
  camera.cy = 77.6;
  return camera;
}

Eigen::Vector3d anywhere(Random& random, double reach) {
  return {random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)};
}

Pose any_pose(Random& random, double reach) {
  return {rotation_exp(anywhere(random, 3)), anywhere(random, reach)};
}

/// Triangles of all sizes, from fans that share edges to slivers, some behind and some around the camera.
Shape soup(Random& random) {
  auto mesh = std::make_shared<TriangleMesh>();
  for (int i = 0; i < 600; ++i) {
    const double size = std::exp(random.uniform(-4, 2));
    const Eigen::Vector3d centre = anywhere(random, 12);
    const auto first = static_cast<std::uint32_t>(mesh->vertices.size());
    for (int corner = 0; corner < 5; ++corner) mesh->vertices.emplace_back(centre + anywhere(random, size));
    for (std::uint32_t corner = 1; corner < 4; ++corner)
      mesh->triangles.push_back({first, first + corner, first + corner + 1});
  }
  return Mesh{mesh, {1, 1, 1}};
}

World random_world(std::uint64_t seed) {
  Random random(seed);
  World world;
  const auto add = [&](const Shape& shape, const Pose& pose) {
    world.visuals.push_back({"shape", pose, shape, {}, true});
  };
  if (seed % 3 != 0) add(soup(random), {});
  if (seed % 3 != 1) {
    add(Rectangle{{0, 0, 1}, {400, 400}}, {Eigen::Quaterniond::Identity(), {0, 0, -3}});
    for (int i = 0; i < 12; ++i) {
      add(Box{anywhere(random, 1.5).cwiseAbs() + Eigen::Vector3d::Constant(0.05)}, any_pose(random, 8));
      add(Ellipsoid{anywhere(random, 1).cwiseAbs() + Eigen::Vector3d::Constant(0.02)}, any_pose(random, 8));
      add(Cylinder{random.uniform(0.01, 0.6), random.uniform(0.1, 5)}, any_pose(random, 8));
      add(Capsule{random.uniform(0.01, 0.3), random.uniform(0.1, 3)}, any_pose(random, 8));
    }
  }
  return world;
}

Scene random_scene(std::uint64_t seed) {
  auto scene = Scene::build(random_world(seed));
  EXPECT_TRUE(scene.ok());
  return std::move(scene).value();
}

class RandomWorlds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomWorlds, LookAsRaysSeeThem) {
  const Scene scene = random_scene(GetParam());
  const RayGrid grid(small_camera());
  Random random(GetParam() + 100);
  int hits = 0;
  int beside = 0;
  for (int view = 0; view < 4; ++view) {
    const Pose pose = any_pose(random, 4);
    const VisibleSurface drawn = visible_surface(scene, grid, pose);
    const VisibleSurface traced = traced_surface(scene, grid, pose);
    std::vector<VisibleSurface> around;
    for (const double x : {-0.02, 0.0, 0.02}) {
      for (const double y : {-0.02, 0.0, 0.02})
        around.push_back(traced_surface(scene, grid, pose, 1, {x, y}));
    }
    for (int v = 0; v < grid.camera().height; ++v) {
      for (int u = 0; u < grid.camera().width; ++u) {
        const auto seen = drawn.primitive.at<std::int32_t>(v, u);
        const float z = drawn.depth.at<float>(v, u);
        ASSERT_EQ(std::isnan(z), !Primitive{static_cast<std::uint32_t>(seen)}.hit());
        if (!std::isnan(z)) ++hits;
        if (seen == traced.primitive.at<std::int32_t>(v, u)) {
          const float truth = traced.depth.at<float>(v, u);
          // A surface seen edge on has no exact depth.
          if (!std::isnan(z)) {
            EXPECT_NEAR(z, truth, 2e-3F * truth) << u << ' ' << v;
          }
          continue;
        }
        ++beside;
        bool found = false;
        for (const VisibleSurface& near : around) {
          const float other = near.depth.at<float>(v, u);
          found |= near.primitive.at<std::int32_t>(v, u) == seen || std::abs(z - other) < 1e-4F * other;
        }
        EXPECT_TRUE(found) << u << ' ' << v << ": " << seen << " at " << z << ", by rays "
                           << traced.primitive.at<std::int32_t>(v, u) << " at "
                           << traced.depth.at<float>(v, u);
      }
    }
  }
  EXPECT_GT(hits, 20000);
  EXPECT_LT(beside, 1e-3 * hits);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomWorlds, testing::Range<std::uint64_t>(1, 13));

/// Of pixels whose surface does not graze the ray, the depths are those of the exact rays.
TEST(Rasteriser, DepthIsTheDoubleOfTheExactRay) {
  const Scene scene = random_scene(3);
  const Camera camera = small_camera();
  const Pose pose = {rotation_exp({2.2, 0.3, -0.4}), {0.5, 1, 0}};  // downward
  const VisibleSurface drawn = scene.rasteriser().draw(camera, pose, 1);
  int compared = 0;
  for (int v = 0; v < camera.height; v += 3) {
    for (int u = 0; u < camera.width; u += 3) {
      const double exact = scene.distance(pose.translation, pose.rotation * *camera.unproject({u, v}));
      const auto z = static_cast<double>(drawn.depth.at<float>(v, u));
      if (std::isnan(exact) || std::abs(z - exact) > 1e-3 * exact) continue;  // an outline
      EXPECT_NEAR(z / exact, 1, 1e-6) << u << ' ' << v;
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000);
}

/// Cameras and places at the limits: the drawn picture is still that of the rays.
TEST(Rasteriser, HoldsForAnyCameraAndPlace) {
  struct Case {
    int width, height;
    double focal, centre_x, centre_y, from_origin;
  };
  for (const Case& c :
       {Case{1, 1, 50, 0, 0, 0}, Case{5, 3, 4, 2, 1, 0}, Case{700, 2, 300, 350, 1, 0},
        Case{2, 300, 200, 1, 150, 0}, Case{200, 150, 20, 100, 75, 0}, Case{200, 150, 20000, 100, 75, 0},
        Case{200, 150, 150, -300, 400, 0}, Case{200, 150, 150, 100, 75, 5000}}) {
    Camera camera;
    camera.width = c.width;
    camera.height = c.height;
    camera.fx = camera.fy = c.focal;
    camera.cx = c.centre_x;
    camera.cy = c.centre_y;
    const RayGrid grid(camera);
    World world = random_world(2);
    const Eigen::Vector3d shift(c.from_origin, -c.from_origin, 0);
    for (Visual& visual : world.visuals) visual.T_world_shape.translation += shift;
    const auto scene = Scene::build(std::move(world));
    ASSERT_TRUE(scene.ok());
    Random random(7);
    int different = 0;
    for (int view = 0; view < 6; ++view) {
      Pose pose = any_pose(random, 3);
      pose.translation += shift;
      const VisibleSurface drawn = visible_surface(*scene, grid, pose);
      const VisibleSurface traced = traced_surface(*scene, grid, pose);
      different += cv::countNonZero(drawn.primitive != traced.primitive);
      EXPECT_EQ(test::count_nan(drawn.depth), cv::countNonZero(drawn.primitive == -1));
    }
    // Rounding shows in fewer than one pixel in a thousand near the origin, and far from it in more: a float
    // has steps of half a millimetre there, for both.
    EXPECT_LE(different, (c.from_origin > 0 ? 2e-2 : 1e-3) * 6 * c.width * c.height + 1)
        << c.width << ' ' << c.height << ' ' << c.focal << ' ' << c.from_origin;
  }
}

bool same_bits(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

TEST(Rasteriser, IsTheSameForAnyInstructionSetAndNumberOfThreads) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Scene scene = random_scene(seed);
    Random random(seed);
    const Pose pose = any_pose(random, 4);
    const VisibleSurface reference =
        scene.rasteriser().draw(small_camera(), pose, 1, simd::InstructionSet::baseline);
    for (const auto set :
         {simd::InstructionSet::baseline, simd::InstructionSet::avx2, simd::InstructionSet::avx512}) {
      if (!simd::available(set, simd::best())) continue;
      for (const int threads : {1, 3}) {
        const VisibleSurface other = scene.rasteriser().draw(small_camera(), pose, threads, set);
        EXPECT_TRUE(same_bits(reference.primitive, other.primitive)) << simd::name(set) << ' ' << threads;
        EXPECT_TRUE(same_bits(reference.depth, other.depth)) << simd::name(set) << ' ' << threads;
      }
    }
  }
}

TEST(Rasteriser, SeesNothingWhereNothingIs) {
  World world;
  world.visuals.push_back({"ball", {}, Ellipsoid{{1, 1, 1}}, {}, true});
  const auto scene = Scene::build(std::move(world));
  ASSERT_TRUE(scene.ok());
  const VisibleSurface drawn =
      scene->rasteriser().draw(small_camera(), {Eigen::Quaterniond::Identity(), {0, 0, 5}}, 1);
  EXPECT_EQ(test::count_nan(drawn.depth), static_cast<int>(drawn.depth.total()));
  EXPECT_EQ(cv::countNonZero(drawn.primitive != -1), 0);
}

/// Two triangles that share an edge leave no gap between them, wherever it lies.
TEST(Rasteriser, LeavesNoGapAlongSharedEdges) {
  Random random(5);
  auto mesh = std::make_shared<TriangleMesh>();  // a fine sheet of 100 x 100 rectangles with shaken nodes
  constexpr int kNodes = 101;
  for (int y = 0; y < kNodes; ++y) {
    for (int x = 0; x < kNodes; ++x)
      mesh->vertices.emplace_back(0.4 * (x - 50) + random.uniform(-0.1, 0.1),
                                  0.4 * (y - 50) + random.uniform(-0.1, 0.1), 5 + random.uniform(-0.1, 0.1));
  }
  for (std::uint32_t y = 0; y + 1 < kNodes; ++y) {
    for (std::uint32_t x = 0; x + 1 < kNodes; ++x) {
      const std::uint32_t i = y * kNodes + x;
      mesh->triangles.push_back({i, i + 1, i + kNodes});
      mesh->triangles.push_back({i + 1, i + kNodes + 1, i + kNodes});
    }
  }
  World world;
  world.visuals.push_back({"sheet", {}, Mesh{mesh, {1, 1, 1}}, {}, true});
  const auto scene = Scene::build(std::move(world));
  ASSERT_TRUE(scene.ok());
  for (int view = 0; view < 20; ++view) {
    const Pose pose = {rotation_exp(anywhere(random, 0.1)), anywhere(random, 1)};
    const VisibleSurface drawn = scene->rasteriser().draw(small_camera(), pose, 1);
    EXPECT_EQ(test::count_nan(drawn.depth), 0);
  }
}

}  // namespace
}  // namespace pade::simulation
