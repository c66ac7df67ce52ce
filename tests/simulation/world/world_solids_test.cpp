#include "pade/simulation/world/world_solids.hpp"

#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "pade/evaluation/map/surface.hpp"
#include "pade/simulation/render/scene.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

const Pose kPlace{rotation_exp({0.4, -0.7, 1.1}), {1, 2, 3}};

World world_of(const Shape& shape, const Pose& pose = kPlace) {
  World world;
  world.visuals.push_back({"shape", pose, shape, {}, true});
  return world;
}

std::shared_ptr<const TriangleMesh> tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return std::make_shared<const TriangleMesh>(mesh);
}

/// Signed distance from the surface in the frame of the shape, in closed form.
double distance_from(const Cylinder& c, const Vector3d& p) {
  const double r = p.head<2>().norm() - c.radius;
  const double z = std::abs(p.z()) - 0.5 * c.length;
  return r > 0 && z > 0 ? std::hypot(r, z) : std::max(r, z);
}
double distance_from(const Capsule& c, const Vector3d& p) {
  return (p - Vector3d(0, 0, std::clamp(p.z(), -0.5 * c.length, 0.5 * c.length))).norm() - c.radius;
}
double distance_from(const Ellipsoid& ball, const Vector3d& p) { return p.norm() - ball.radii.x(); }
double distance_from(const Box& box, const Vector3d& p) {
  const Vector3d d = p.cwiseAbs() - 0.5 * box.size;
  return d.cwiseMax(0).norm() + std::min(0.0, d.maxCoeff());
}

template <class AnyShape>
void expect_closed_form(const AnyShape& shape, double deviation) {
  const World world = world_of(shape);
  const evaluation::Surface surface(surface_triangles(world, deviation));
  const evaluation::PlacedSurface placed(surface);
  const WorldSolids solids(world);
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> number(-1.5, 1.5);
  for (int i = 0; i < 400; ++i) {
    const Vector3d p(number(engine), number(engine), number(engine));
    const double truth = distance_from(shape, p);
    const double found = placed.distance(Vector3d(kPlace * p), 10);
    EXPECT_NEAR(found, std::abs(truth), deviation + 1e-9) << p.transpose();
    EXPECT_EQ(solids.inside(kPlace * p), truth < 0) << p.transpose();
  }
}

TEST(SurfaceTriangles, AreWithinTheDeviationOfTheShape) {
  expect_closed_form(Box{{1, 0.6, 1.4}}, 1e-9);
  expect_closed_form(Cylinder{0.3, 1.2}, 0.001);
  expect_closed_form(Cylinder{0.5, 0.4}, 0.02);
  expect_closed_form(Capsule{0.3, 0.9}, 0.001);
  expect_closed_form(Ellipsoid{{0.7, 0.7, 0.7}}, 0.001);
}

/// Each corner lies on the ellipsoid, and the middle of each triangle within the deviation of it.
TEST(SurfaceTriangles, OfAnEllipsoidAreWithinTheDeviation) {
  const Ellipsoid shape{{1.5, 0.4, 0.8}};
  const auto triangles = surface_triangles(world_of(shape, {}), 0.002);
  for (const auto& triangle : triangles) {
    for (const Vector3d& corner : triangle) EXPECT_NEAR(corner.cwiseQuotient(shape.radii).norm(), 1, 1e-12);
    const Vector3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
    // On the ray from the centre the surface is 1 / |middle| times as far: an upper bound of the distance.
    EXPECT_LE(middle.norm() * (1 / middle.cwiseQuotient(shape.radii).norm() - 1), 0.002);
  }
}

/// What the renderer's rays hit lies on the triangles: both see one world.
TEST(SurfaceTriangles, LieWhereRaysHit) {
  World world = world_of(Rectangle{{0.2, -1, 0.3}, {5, 3}});
  world.visuals.push_back(
      {"mesh", {rotation_exp({0, 0.5, 0}), {0, 0, 2}}, Mesh{tetrahedron(), {2, 1, -1.5}}, {}, true});
  world.visuals.push_back({"capsule", {rotation_exp({1, 0.5, 0}), {3, 0, 2}}, Capsule{0.4, 1}, {}, true});
  const evaluation::Surface surface(surface_triangles(world));
  const evaluation::PlacedSurface placed(surface);
  const auto scene = Scene::build(world);
  ASSERT_TRUE(scene.ok());
  std::mt19937 engine(6);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d origin(4 * normal(engine), 4 * normal(engine), 4 * normal(engine));
    const Vector3d direction = Vector3d(normal(engine), normal(engine), normal(engine)).normalized();
    const double t = scene->distance(origin, direction);
    if (std::isnan(t)) continue;
    ++hits;
    EXPECT_LE(placed.distance(Vector3d(origin + t * direction), 1), 0.0011);
  }
  EXPECT_GT(hits, 50);
}

TEST(WorldSolids, AMeshHasAnInsideOnlyWhereItIsClosed) {
  const Mesh closed{tetrahedron(), {1, 1, 1}};
  TriangleMesh open = *tetrahedron();
  open.triangles.pop_back();
  const Mesh without_a_side{std::make_shared<const TriangleMesh>(open), {1, 1, 1}};
  const Mesh mirrored{tetrahedron(), {-1, 1, 1}};
  const Vector3d inside(0.2, 0.2, 0.2);
  const Vector3d outside(0.5, 0.5, 0.5);
  EXPECT_TRUE(WorldSolids(world_of(closed)).inside(kPlace * inside));
  EXPECT_FALSE(WorldSolids(world_of(closed)).inside(kPlace * outside));
  EXPECT_FALSE(WorldSolids(world_of(without_a_side)).inside(kPlace * inside));
  EXPECT_TRUE(WorldSolids(world_of(mirrored)).inside(kPlace * Vector3d(-0.2, 0.2, 0.2)));
}

/// Files that keep texture coordinates repeat a corner for each face.
TEST(WorldSolids, CornersInOnePlaceAreOne) {
  TriangleMesh mesh;
  const auto shared = tetrahedron();
  for (const auto& corner : shared->triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const std::uint32_t i : corner) mesh.vertices.push_back(shared->vertices[i]);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const Mesh apart{std::make_shared<const TriangleMesh>(mesh), {1, 1, 1}};
  EXPECT_TRUE(WorldSolids(world_of(apart)).inside(kPlace * Vector3d(0.2, 0.2, 0.2)));
}

TEST(WorldSolids, ARectangleHasNoInside) {
  EXPECT_FALSE(WorldSolids(world_of(Rectangle{{0, 0, 1}, {5, 5}})).inside(kPlace * Vector3d(0, 0, 0)));
}

}  // namespace
}  // namespace pade::simulation
