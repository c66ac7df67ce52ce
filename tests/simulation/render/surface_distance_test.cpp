#include "pade/simulation/render/surface_distance.hpp"

#include <cmath>
#include <memory>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "pade/evaluation/map/surface.hpp"
#include "pade/simulation/generator/mesh_generator.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

const Pose kAt{rotation_exp({0.4, -0.7, 1.1}), {21, -12, 3}};

struct Solid {
  Scene scene;
  SurfaceDistance distance;
};

Solid solid_of(const std::vector<std::pair<Shape, Pose>>& shapes) {
  World world;
  for (const auto& [shape, pose] : shapes) world.visuals.push_back({"shape", pose, shape, {}, true});
  auto scene = Scene::build(std::move(world));
  EXPECT_TRUE(scene.ok());
  auto distance = SurfaceDistance::build(*scene);
  EXPECT_TRUE(distance.ok());
  return {std::move(scene).value(), std::move(distance).value()};
}

/// Signed distance from the surface in the frame of the shape, in closed form.
double signed_distance(const Box& box, const Vector3d& p) {
  const Vector3d d = p.cwiseAbs() - 0.5 * box.size;
  return d.cwiseMax(0).norm() + std::min(0.0, d.maxCoeff());
}
double signed_distance(const Ellipsoid& ball, const Vector3d& p) { return p.norm() - ball.radii.x(); }
double signed_distance(const Cylinder& c, const Vector3d& p) {
  const double r = p.head<2>().norm() - c.radius;
  const double z = std::abs(p.z()) - 0.5 * c.length;
  return r > 0 && z > 0 ? std::hypot(r, z) : std::max(r, z);
}

template <class AnyShape>
void expect_distance(const AnyShape& shape, double tolerance) {
  const Solid solid = solid_of({{shape, kAt}});
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> number(-2, 2);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p(number(engine), number(engine), number(engine));
    const double truth = signed_distance(shape, p);
    const Vector3d world = kAt * p;
    EXPECT_NEAR(solid.distance.to(world), std::abs(truth), tolerance) << p.transpose();
    EXPECT_EQ(solid.distance.inside(world), truth < 0) << p.transpose();
    EXPECT_EQ(solid.distance.touches(world, 0.35), truth < 0.35) << p.transpose();
  }
}

TEST(SurfaceDistance, IsThatOfTheClosedForms) {
  expect_distance(Box{{1, 0.6, 1.4}}, 2e-6);
  expect_distance(Ellipsoid{{0.7, 0.7, 0.7}}, 1e-12);
  expect_distance(Cylinder{0.3, 1.2}, 1e-12);
}

/// Against the same shape as triangles, which lie within the deviation of it, by brute force.
void expect_as_triangles(const World& world, double tolerance) {
  const evaluation::Surface surface(surface_triangles(world, 0.5 * tolerance));
  const evaluation::PlacedSurface placed(surface);
  auto scene = Scene::build(world);
  ASSERT_TRUE(scene.ok());
  auto distance = SurfaceDistance::build(*scene);
  ASSERT_TRUE(distance.ok());
  std::mt19937 engine(11);
  std::uniform_real_distribution<double> number(-3, 3);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = kAt * Vector3d(number(engine), number(engine), number(engine));
    EXPECT_NEAR(distance->to(p), placed.distance(p, 10), tolerance);
  }
}

TEST(SurfaceDistance, OfAnEllipsoidIsThatOfItsTriangles) {
  World world;
  world.visuals.push_back({"egg", kAt, Ellipsoid{{1.5, 0.4, 0.8}}, {}, true});
  expect_as_triangles(world, 0.002);
}

std::shared_ptr<const TriangleMesh> parse(const std::string& obj) {
  TriangleMesh mesh;
  std::istringstream lines(obj);
  for (char kind = 0; lines >> kind;) {
    Vector3d v;
    std::array<std::uint32_t, 3> corners{};
    if (kind == 'v' && lines >> v.x() >> v.y() >> v.z()) mesh.vertices.push_back(v);
    if (kind == 'f' && lines >> corners[0] >> corners[1] >> corners[2])
      mesh.triangles.push_back({corners[0] - 1, corners[1] - 1, corners[2] - 1});
  }
  return std::make_shared<const TriangleMesh>(mesh);
}

TEST(SurfaceDistance, SeesTreesAndStones) {
  Random random(3);
  const TreeMeshes tree = grow_tree(TreeShape::garden(), random);
  World world;
  world.visuals.push_back({"wood", kAt, Mesh{parse(tree.wood)}, {}, true});
  world.visuals.push_back({"leaves", kAt, Mesh{parse(tree.leaves)}, {}, true});
  world.visuals.push_back({"stone", kAt, Mesh{parse(break_stone(random)), {1, 2, 1}}, {}, true});
  expect_as_triangles(world, 2e-5);
}

TEST(SurfaceDistance, IsAtMostWhatIsAskedFor) {
  const Solid solid = solid_of({{Ellipsoid{{1, 1, 1}}, {}}});
  EXPECT_EQ(solid.distance.to({4, 0, 0}, 2), 2);
  EXPECT_NEAR(solid.distance.to({4, 0, 0}, 3.5), 3, 1e-12);
  EXPECT_EQ(solid.distance.to({0, 0, 0}, 0.5), 0.5);
}

}  // namespace
}  // namespace pade::simulation
