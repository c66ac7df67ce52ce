#include "pade/simulation/world/extrusion.hpp"

#include <algorithm>
#include <numeric>

namespace pade::simulation {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double area_of(const std::vector<Vector2d>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * twice;
}

bool is_inside(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return cross(b - a, p - a) >= 0 && cross(c - b, p - b) >= 0 && cross(a - c, p - c) >= 0;
}

/// Ear clipping of a polygon that turns left (Meisters, "Polygons have ears", 1975).
std::vector<std::array<std::uint32_t, 3>> triangulate(const std::vector<Vector2d>& polygon) {
  std::vector<std::uint32_t> rest(polygon.size());
  std::iota(rest.begin(), rest.end(), 0U);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const auto is_ear = [&](std::size_t i, bool strict) {
    const std::uint32_t before = rest[(i + rest.size() - 1) % rest.size()];
    const std::uint32_t after = rest[(i + 1) % rest.size()];
    const Vector2d &a = polygon[before], &b = polygon[rest[i]], &c = polygon[after];
    if (strict && !(cross(b - a, c - b) > 0)) return false;
    return std::none_of(rest.begin(), rest.end(), [&](std::uint32_t k) {
      return k != before && k != rest[i] && k != after && polygon[k] != a && polygon[k] != b &&
             polygon[k] != c && is_inside(polygon[k], a, b, c);
    });
  };
  while (rest.size() > 2) {
    std::size_t ear = rest.size();
    for (const bool strict : {true, false}) {
      for (std::size_t i = 0; i < rest.size() && ear == rest.size(); ++i) {
        if (is_ear(i, strict)) ear = i;
      }
    }
    if (ear == rest.size()) ear = 0;  // the outline crosses itself: whatever is drawn is as good
    triangles.push_back(
        {rest[(ear + rest.size() - 1) % rest.size()], rest[ear], rest[(ear + 1) % rest.size()]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return triangles;
}

}  // namespace

Result<TriangleMesh> extrude(std::vector<Vector2d> polygon, double height) {
  polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
  while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
  if (polygon.size() < 3) return Error{"found fewer than three different points, expected a polygon"};
  const double area = area_of(polygon);
  if (!(std::abs(area) > 0)) return Error{"found a polygon without area"};
  if (!(height > 0)) return Error{"expected a height above 0"};
  if (area < 0) std::reverse(polygon.begin(), polygon.end());

  TriangleMesh mesh;
  const auto count = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {0.0, height}) {
    for (const Vector2d& p : polygon) mesh.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (const auto& [a, b, c] : triangulate(polygon)) {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({a + count, b + count, c + count});
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    mesh.triangles.push_back({i, next, next + count});
    mesh.triangles.push_back({i, next + count, i + count});
  }
  return mesh;
}

}  // namespace pade::simulation
