#include "pade/simulation/world/extrusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace pade::simulation {
namespace {

using Eigen::Vector2d;
using Ring = std::vector<std::uint32_t>;  ///< points of the mesh's floor, in order

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double area_of(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * twice;
}

/// Whether p is inside, by the edges that a ray along +x crosses.
bool contains(const Polygon& polygon, const Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) > p.x()) inside = !inside;
  }
  return inside;
}

/// Whether `inner` lies in `outer`: a point of it does, and not on an edge that both have.
bool is_nested(const Polygon& inner, const Polygon& outer) {
  const auto within =
      std::count_if(inner.begin(), inner.end(), [&](const Vector2d& p) { return contains(outer, p); });
  return 2 * within > static_cast<std::ptrdiff_t>(inner.size());
}

bool is_in_triangle(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return cross(b - a, p - a) >= 0 && cross(c - b, p - b) >= 0 && cross(a - c, p - c) >= 0;
}

/// Whether the segments cross in a point that is an end of neither.
bool cross_inside(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](double v) { return v > 0 ? 1 : v < 0 ? -1 : 0; };
  return side(cross(b - a, c - a)) * side(cross(b - a, d - a)) < 0 &&
         side(cross(d - c, a - c)) * side(cross(d - c, b - c)) < 0;
}

/// Cuts ears from rings of points.
class Triangulation {
 public:
  explicit Triangulation(const Polygon& points) : points_(points) {}

  /// Cuts `outer` (which turns left) open to each hole (which turns right), and the whole into triangles
  /// (Meisters, "Polygons have ears", 1975; Eberly, "Triangulation by ear clipping", 2002).
  std::vector<std::array<std::uint32_t, 3>> operator()(Ring outer, std::vector<Ring> holes) const {
    // From the right, so that no hole lies between the one that is joined and what it is joined to.
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < holes.size(); ++i) {
      rotate_rightmost_first(holes[i]);
      order.emplace_back(-at(holes[i].front()).x(), i);
    }
    std::sort(order.begin(), order.end());
    for (const auto& [x, i] : order) join(outer, holes[i]);
    return cut(std::move(outer));
  }

 private:
  [[nodiscard]] const Vector2d& at(std::uint32_t i) const { return points_[i]; }

  void rotate_rightmost_first(Ring& ring) const {
    std::rotate(
        ring.begin(),
        std::max_element(ring.begin(), ring.end(), [&](auto a, auto b) { return at(a).x() < at(b).x(); }),
        ring.end());
  }

  [[nodiscard]] bool sees(const Ring& ring, const Ring& hole, std::size_t i) const {
    const Vector2d &from = at(hole.front()), &to = at(ring[i]);
    const Vector2d &before = at(ring[(i + ring.size() - 1) % ring.size()]),
                   &after = at(ring[(i + 1) % ring.size()]);
    const double turn = cross(to - before, after - to);
    const bool left_in = cross(to - before, from - to) > 0, left_out = cross(after - to, from - to) > 0;
    if (!(turn > 0 ? left_in && left_out : left_in || left_out))
      return false;  // not towards the inside at that corner
    const auto crossed = [&](const Ring& other) {
      for (std::size_t k = 0; k < other.size(); ++k) {
        if (cross_inside(from, to, at(other[k]), at(other[(k + 1) % other.size()]))) return true;
      }
      return false;
    };
    return !crossed(ring) && !crossed(hole);
  }

  /// Goes from the nearest point of the ring that the hole's first one sees around the hole and back.
  void join(Ring& ring, const Ring& hole) const {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const double distance = (at(ring[i]) - at(hole.front())).squaredNorm();
      if (distance < least && sees(ring, hole, i)) {
        least = distance;
        best = i;
      }
    }
    Ring around(hole.begin(), hole.end());
    around.push_back(hole.front());
    around.push_back(ring[best]);
    ring.insert(ring.begin() + static_cast<std::ptrdiff_t>(best) + 1, around.begin(), around.end());
  }

  [[nodiscard]] bool is_ear(const Ring& rest, std::size_t i, bool strict) const {
    const std::uint32_t before = rest[(i + rest.size() - 1) % rest.size()];
    const std::uint32_t after = rest[(i + 1) % rest.size()];
    const Vector2d &a = at(before), &b = at(rest[i]), &c = at(after);
    if (strict && !(cross(b - a, c - b) > 0)) return false;
    for (std::size_t k = 0; k < rest.size(); ++k) {
      const Vector2d& p = at(rest[k]);
      if (p != a && p != b && p != c && is_in_triangle(p, a, b, c)) return false;
      if (cross_inside(a, c, p, at(rest[(k + 1) % rest.size()]))) return false;
    }
    return true;
  }

  [[nodiscard]] std::vector<std::array<std::uint32_t, 3>> cut(Ring rest) const {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    while (rest.size() > 2) {
      std::size_t ear = rest.size();
      for (const bool strict : {true, false}) {
        for (std::size_t i = 0; i < rest.size() && ear == rest.size(); ++i) {
          if (is_ear(rest, i, strict)) ear = i;
        }
      }
      if (ear == rest.size()) ear = 0;  // the outline crosses itself: whatever is drawn is as good
      triangles.push_back(
          {rest[(ear + rest.size() - 1) % rest.size()], rest[ear], rest[(ear + 1) % rest.size()]});
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    return triangles;
  }

  const Polygon& points_;
};

/// Without points that repeat; the error says what is wrong.
Status clean(Polygon& polygon) {
  polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
  while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
  if (polygon.size() < 3) return Error{"found fewer than three different points, expected a polygon"};
  if (!(std::abs(area_of(polygon)) > 0)) return Error{"found a polygon without area"};
  return {};
}

}  // namespace

Result<TriangleMesh> extrude(std::vector<Polygon> polygons, double height) {
  for (Polygon& polygon : polygons) {
    if (const Status good = clean(polygon); !good) return good.error();
  }
  if (!(height > 0)) return Error{"expected a height above 0"};
  std::vector<std::vector<bool>> lies_in(polygons.size(), std::vector<bool>(polygons.size()));
  std::vector<std::size_t> depth(polygons.size());  // 0 = solid, 1 = a hole in it, 2 = solid in the hole ...
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    for (std::size_t k = 0; k < polygons.size(); ++k) {
      lies_in[i][k] = i != k && is_nested(polygons[i], polygons[k]);
      depth[i] += lies_in[i][k] ? 1 : 0;
    }
  }
  Polygon points;
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    const bool solid = depth[i] % 2 == 0;
    if ((area_of(polygons[i]) > 0) != solid) std::reverse(polygons[i].begin(), polygons[i].end());
    Ring ring(polygons[i].size());
    std::iota(ring.begin(), ring.end(), static_cast<std::uint32_t>(points.size()));
    points.insert(points.end(), polygons[i].begin(), polygons[i].end());
    rings.push_back(std::move(ring));
  }

  TriangleMesh mesh;
  const auto count = static_cast<std::uint32_t>(points.size());
  for (const double z : {0.0, height}) {
    for (const Vector2d& p : points) mesh.vertices.emplace_back(p.x(), p.y(), z);
  }
  const Triangulation triangulate(points);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    for (std::size_t k = 0; k < rings[i].size(); ++k) {
      const std::uint32_t here = rings[i][k];
      const std::uint32_t next = rings[i][(k + 1) % rings[i].size()];
      mesh.triangles.push_back({here, next, next + count});
      mesh.triangles.push_back({here, next + count, here + count});
    }
    if (depth[i] % 2 != 0) continue;
    std::vector<Ring> holes;
    for (std::size_t k = 0; k < rings.size(); ++k) {
      if (lies_in[k][i] && depth[k] == depth[i] + 1) holes.push_back(rings[k]);
    }
    for (const auto& [a, b, c] : triangulate(rings[i], std::move(holes))) {
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({a + count, b + count, c + count});
    }
  }
  return mesh;
}

}  // namespace pade::simulation
