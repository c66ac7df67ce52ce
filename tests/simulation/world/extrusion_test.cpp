#include "pade/simulation/world/extrusion.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A star around a centre, turned left where `left`; its radii lie between `least` and `most`.
Polygon star(Random& random, const Vector2d& centre, double least, double most, bool left) {
  const int corners = 3 + static_cast<int>(random.uniform() * 12);
  Polygon polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = (left ? 1 : -1) * 2 * std::numbers::pi * i / corners;
    polygon.push_back(centre + (least + (most - least) * random.uniform()) *
                                   Vector2d(std::cos(angle), std::sin(angle)));
  }
  return polygon;
}

double area_of(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

/// By Gauss' theorem, of a mesh that is closed.
double volume_of(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6;
  return volume;
}

double surface_of_caps(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d n = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    area += std::abs(n.z()) / 2;
  }
  return area;
}

/// Each edge belongs to two triangles that go along it in opposite directions.
void expect_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    ++edges[{a, b}];
    ++edges[{b, c}];
    ++edges[{c, a}];
  }
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    ASSERT_NE(back, edges.end()) << edge.first << ' ' << edge.second;
    EXPECT_EQ(count, back->second);
  }
}

TEST(Extrusion, OfNestedPolygonsHasTheVolumeBetweenThem) {
  Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    // Radii of a polygon's edges may come as near as least * cos(pi / 3) to its centre.
    std::vector<Polygon> polygons = {star(random, {0, 0}, 10, 14, trial % 2 == 0)};
    double area = area_of(polygons[0]);
    const int holes = trial % 5;
    for (int i = 0; i < holes; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.3 * random.uniform()) / holes;
      const Vector2d centre = 2.8 * Vector2d(std::cos(angle), std::sin(angle));
      polygons.push_back(star(random, centre, 1.0, 1.4, random.uniform() < 0.5));
      area -= area_of(polygons.back());
      if (i % 2 == 0) continue;
      polygons.push_back(star(random, centre, 0.2, 0.4, random.uniform() < 0.5));
      area += area_of(polygons.back());
    }
    std::swap(polygons.front(),
              polygons[static_cast<std::size_t>(random.uniform() * static_cast<double>(polygons.size()))]);
    const auto mesh = extrude(polygons, 2.5);
    ASSERT_TRUE(mesh) << mesh.error().message;
    expect_closed(*mesh);
    EXPECT_NEAR(volume_of(*mesh), 2.5 * area, 1e-9 * area) << trial;
    EXPECT_NEAR(surface_of_caps(*mesh), 2 * area, 1e-9 * area) << trial << ": triangles lie on each other";
  }
}

TEST(Extrusion, RefusesWhatIsNoPolygon) {
  const Polygon square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_FALSE(extrude({square, {{0, 0}, {1, 0}, {0, 0}}}, 1));
  EXPECT_FALSE(extrude({square, {{0, 0}, {1, 0}, {2, 0}}}, 1));
  EXPECT_FALSE(extrude({square}, 0));
  EXPECT_TRUE(extrude({square}, 1));
}

}  // namespace
}  // namespace pade::simulation
