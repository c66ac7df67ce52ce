#include "pade/simulation/world/world_solids.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include <Eigen/LU>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
using Triangles = std::vector<std::array<Vector3d, 3>>;

constexpr double kLongest = 0.5;  // metres of a round shape's side: long slivers make bad boxes

/// Into how many parts a circle goes so that its chords stay within `deviation`.
int parts_of_circle(double radius, double deviation) {
  if (deviation >= radius) return 8;
  return std::max(8, static_cast<int>(std::ceil(std::numbers::pi / std::acos(1 - deviation / radius))));
}

class Tessellator {
 public:
  Tessellator(const Visual& visual, double deviation, Triangles& out)
      : T_(visual.T_world_shape), deviation_(deviation), out_(out) {}

  void operator()(const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      const int next = (axis + 1) % 3;
      const int last = (axis + 2) % 3;
      for (const double side : {-0.5, 0.5}) {
        quad([&](double a, double b) {
          Vector3d p;
          p[axis] = side * box.size[axis];
          p[next] = (a - 0.5) * box.size[next];
          p[last] = (b - 0.5) * box.size[last];
          return p;
        });
      }
    }
  }
  void operator()(const Rectangle& rectangle) {
    const Eigen::Quaterniond turn = rotation_between(Vector3d::UnitZ(), rectangle.normal);
    quad([&](double a, double b) {
      return Vector3d(turn * Vector3d((a - 0.5) * rectangle.size.x(), (b - 0.5) * rectangle.size.y(), 0));
    });
  }
  void operator()(const Ellipsoid& e) { cap(e.radii, 0, -1, 1); }
  void operator()(const Cylinder& c) {
    side(c.radius, c.length);
    const int n = parts_of_circle(c.radius, deviation_);
    for (const double z : {-0.5 * c.length, 0.5 * c.length}) {
      for (int i = 0; i < n; ++i) {
        add(Vector3d(0, 0, z), on_circle(c.radius, i, n, z), on_circle(c.radius, i + 1, n, z));
      }
    }
  }
  void operator()(const Capsule& c) {
    side(c.radius, c.length);
    cap(Vector3d::Constant(c.radius), -0.5 * c.length, -1, 0);
    cap(Vector3d::Constant(c.radius), 0.5 * c.length, 0, 1);
  }
  void operator()(const Mesh& mesh) {
    const TriangleMesh& data = *mesh.triangles;
    for (const auto& corner : data.triangles) {
      add(mesh.scale.cwiseProduct(data.vertices[corner[0]]),
          mesh.scale.cwiseProduct(data.vertices[corner[1]]),
          mesh.scale.cwiseProduct(data.vertices[corner[2]]));
    }
  }

 private:
  void add(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    out_.push_back({T_ * a, T_ * b, T_ * c});
  }
  template <class At>
  void quad(const At& at) {
    add(at(0, 0), at(1, 0), at(1, 1));
    add(at(0, 0), at(1, 1), at(0, 1));
  }
  static Vector3d on_circle(double radius, int i, int n, double z) {
    const double angle = 2 * std::numbers::pi * (i % n) / n;
    return {radius * std::cos(angle), radius * std::sin(angle), z};
  }
  /// The side of a cylinder about z.
  void side(double radius, double length) {
    const int n = parts_of_circle(radius, deviation_);
    const int rings = std::max(1, static_cast<int>(std::ceil(length / kLongest)));
    for (int ring = 0; ring < rings; ++ring) {
      const double z0 = (static_cast<double>(ring) / rings - 0.5) * length;
      const double z1 = (static_cast<double>(ring + 1) / rings - 0.5) * length;
      for (int i = 0; i < n; ++i) {
        add(on_circle(radius, i, n, z0), on_circle(radius, i + 1, n, z0), on_circle(radius, i + 1, n, z1));
        add(on_circle(radius, i, n, z0), on_circle(radius, i + 1, n, z1), on_circle(radius, i, n, z1));
      }
    }
  }
  /// The part of an ellipsoid about (0, 0, centre) between two of the heights -1 (south pole), 0 and 1.
  void cap(const Vector3d& radii, double centre, int from, int to) {
    // Both directions bend: each may take half of the deviation.
    const int n = parts_of_circle(radii.maxCoeff(), 0.5 * deviation_);
    const int rows = (n + 3) / 4 * (to - from);
    const auto at = [&](int row, int i) {
      const double latitude = 0.5 * std::numbers::pi * (from + static_cast<double>(row) / ((n + 3) / 4));
      const bool pole = (row == 0 && from == -1) || (row == rows && to == 1);
      const Vector3d ring = on_circle(pole ? 0 : std::cos(latitude), i, n, std::sin(latitude));
      return Vector3d(radii.cwiseProduct(ring) + Vector3d(0, 0, centre));
    };
    for (int row = 0; row < rows; ++row) {
      for (int i = 0; i < n; ++i) {
        if (row > 0 || from != -1) add(at(row, i), at(row, i + 1), at(row + 1, i + 1));
        if (row + 1 < rows || to != 1) add(at(row, i), at(row + 1, i + 1), at(row + 1, i));
      }
    }
  }

  const Pose& T_;
  double deviation_;
  Triangles& out_;
};

/// Each edge has two triangles, one for each way along it. Vertices in the same place are one: files that
/// keep texture coordinates repeat them.
bool is_closed(const TriangleMesh& mesh) {
  std::map<std::array<double, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> place_of;
  for (const Vector3d& v : mesh.vertices) {
    place_of.push_back(
        places.try_emplace({v.x(), v.y(), v.z()}, static_cast<std::uint32_t>(places.size())).first->second);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& corner : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = place_of[corner[i]];
      const std::uint32_t to = place_of[corner[(i + 1) % 3]];
      if (from != to && !edges.emplace(from, to).second) return false;
    }
  }
  return !edges.empty() && std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    return edges.contains({edge.second, edge.first});
  });
}

/// How often the mesh goes around a point: the sum of its solid angles (van Oosterom and Strackee 1983) / 4
/// pi.
double winding_number(const Mesh& mesh, const Vector3d& point) {
  double sum = 0;
  for (const auto& corner : mesh.triangles->triangles) {
    const auto at = [&](std::size_t i) {
      return Vector3d(mesh.scale.cwiseProduct(mesh.triangles->vertices[corner[i]]) - point);
    };
    const Vector3d a = at(0);
    const Vector3d b = at(1);
    const Vector3d c = at(2);
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

/// In the frame of the shape; empty where the shape has no inside.
Eigen::AlignedBox3d bounds_of(const Shape& shape) {
  const auto symmetric = [](const Vector3d& half) { return Eigen::AlignedBox3d(-half, half); };
  if (const auto* box = std::get_if<Box>(&shape)) return symmetric(0.5 * box->size);
  if (const auto* ellipsoid = std::get_if<Ellipsoid>(&shape)) return symmetric(ellipsoid->radii);
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    return symmetric({cylinder->radius, cylinder->radius, 0.5 * cylinder->length});
  }
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    return symmetric({capsule->radius, capsule->radius, 0.5 * capsule->length + capsule->radius});
  }
  Eigen::AlignedBox3d bounds;
  if (const auto* mesh = std::get_if<Mesh>(&shape); mesh != nullptr && is_closed(*mesh->triangles)) {
    for (const Vector3d& vertex : mesh->triangles->vertices) bounds.extend(mesh->scale.cwiseProduct(vertex));
  }
  return bounds;
}

struct Inside {
  const Vector3d& p;  // in the bounds of the shape
  bool operator()(const Box& box) const { return (p.cwiseAbs().array() < 0.5 * box.size.array()).all(); }
  bool operator()(const Ellipsoid& e) const { return p.cwiseQuotient(e.radii).squaredNorm() < 1; }
  bool operator()(const Cylinder& c) const {
    return p.head<2>().norm() < c.radius && std::abs(p.z()) < 0.5 * c.length;
  }
  bool operator()(const Capsule& c) const {
    const double along = std::clamp(p.z(), -0.5 * c.length, 0.5 * c.length);
    return (p - Vector3d(0, 0, along)).norm() < c.radius;
  }
  bool operator()(const Rectangle& /*unused*/) const { return false; }
  bool operator()(const Mesh& mesh) const { return std::abs(winding_number(mesh, p)) > 0.5; }
};

}  // namespace

std::vector<std::array<Eigen::Vector3d, 3>> surface_triangles(const World& world, double deviation) {
  Triangles triangles;
  for (const Visual& visual : world.visuals)
    std::visit(Tessellator(visual, deviation, triangles), visual.shape);
  return triangles;
}

WorldSolids::WorldSolids(const World& world) {
  for (const Visual& visual : world.visuals) {
    const Eigen::AlignedBox3d bounds = bounds_of(visual.shape);
    if (!bounds.isEmpty()) solids_.push_back({bounds, visual.T_world_shape.inverse(), visual.shape});
  }
}

bool WorldSolids::inside(const Eigen::Vector3d& point) const {
  return std::any_of(solids_.begin(), solids_.end(), [&](const Solid& solid) {
    const Vector3d p = solid.T_shape_world * point;
    return solid.bounds.contains(p) && std::visit(Inside{p}, solid.shape);
  });
}

}  // namespace pade::simulation
