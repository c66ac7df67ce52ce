#include "pade/simulation/world/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <fmt/format.h>

#include "pade/core/pose.hpp"

namespace pade::simulation {
namespace {

/// Distance between the nodes of a patch where that many fit.
constexpr double kNodeSpacing = 0.25;
constexpr int kMostNodes = 513;

int nodes_for(double length) {
  return std::clamp(static_cast<int>(std::ceil(length / kNodeSpacing)) + 1, 2, kMostNodes);
}

/// A shift of the pattern that differs between visuals, so that equal shapes do not look alike. Metres.
Eigen::Vector2d pattern_shift(std::size_t visual) {
  const auto n = static_cast<double>(visual);
  return {std::fmod(n * 1.6180339887, 7.0), std::fmod(n * 2.2360679775, 7.0)};
}

class Builder {
 public:
  Builder(Geometry& geometry, const Visual& visual, std::size_t index)
      : out_(geometry), visual_(visual), index_(index), R_(visual.T_world_shape.matrix3()) {}

  void operator()(const Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        const Eigen::Vector3d normal = side * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d up = axis == 2 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
        const Eigen::Vector3d right = up.cross(normal);
        face(0.5 * box.size[axis] * normal, normal, right, up, box.size.dot(right.cwiseAbs()),
             box.size.dot(up.cwiseAbs()));
      }
    }
  }
  void operator()(const Rectangle& rectangle) {
    const Eigen::Quaterniond turn = rotation_between(Eigen::Vector3d::UnitZ(), rectangle.normal);
    face(Eigen::Vector3d::Zero(), rectangle.normal.normalized(), turn * Eigen::Vector3d::UnitX(),
         turn * Eigen::Vector3d::UnitY(), rectangle.size.x(), rectangle.size.y());
  }
  void operator()(const Ellipsoid& e) { quadric(Quadric::Kind::sphere, Eigen::Vector3d::Zero(), e.radii); }
  void operator()(const Cylinder& c) {
    quadric(Quadric::Kind::cylinder, Eigen::Vector3d::Zero(), {c.radius, c.radius, 0.5 * c.length});
  }
  void operator()(const Capsule& c) {
    quadric(Quadric::Kind::tube, Eigen::Vector3d::Zero(), {c.radius, c.radius, 0.5 * c.length});
    for (const double side : {-1.0, 1.0}) {
      quadric(Quadric::Kind::sphere, {0, 0, 0.5 * side * c.length}, Eigen::Vector3d::Constant(c.radius));
    }
  }
  void operator()(const Mesh& mesh);

 private:
  /// A rectangle about `centre` (shape frame) with unit axes `right` and `up` as seen from outside.
  void face(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, const Eigen::Vector3d& right,
            const Eigen::Vector3d& up, double width, double height);
  void quadric(Quadric::Kind kind, const Eigen::Vector3d& centre, const Eigen::Vector3d& half_extent);
  std::uint32_t vertex(const Eigen::Vector3d& world) {
    out_.vertices.push_back(
        {static_cast<float>(world.x()), static_cast<float>(world.y()), static_cast<float>(world.z())});
    out_.vertex_normals.emplace_back(Eigen::Vector3f::Zero());
    return static_cast<std::uint32_t>(out_.vertices.size() - 1);
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    out_.triangles.push_back({a, b, c});
    out_.facet_of_triangle.push_back(static_cast<std::uint32_t>(out_.facets.size() - 1));
  }
  /// Coordinates right . p and up . p in metres, shifted per visual; p in the shape frame.
  [[nodiscard]] TextureFrame metric_frame(const Eigen::Vector3d& right, const Eigen::Vector3d& up) const;

  Geometry& out_;
  const Visual& visual_;
  std::size_t index_;
  Eigen::Matrix3d R_;
};

TextureFrame affine(const Eigen::Vector3d& gradient_u, const Eigen::Vector3d& gradient_v,
                    const Eigen::Vector3d& point, const Eigen::Vector2d& value) {
  TextureFrame frame;
  frame.gradient_u = gradient_u.cast<float>();
  frame.gradient_v = gradient_v.cast<float>();
  frame.u0 = static_cast<float>(value.x() - gradient_u.dot(point));
  frame.v0 = static_cast<float>(value.y() - gradient_v.dot(point));
  return frame;
}

TextureFrame Builder::metric_frame(const Eigen::Vector3d& right, const Eigen::Vector3d& up) const {
  return affine(R_ * right, R_ * up, visual_.T_world_shape.translation, pattern_shift(index_));
}

void Builder::face(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, const Eigen::Vector3d& right,
                   const Eigen::Vector3d& up, double width, double height) {
  const Eigen::Vector3d middle = visual_.T_world_shape * centre;
  Facet facet;
  facet.normal = R_ * normal;
  facet.offset = facet.normal.dot(middle);
  facet.visual = static_cast<std::int32_t>(index_);
  facet.texture = visual_.material.image ? affine(R_ * right / width, -(R_ * up) / height, middle, {0.5, 0.5})
                                         : metric_frame(right, up);

  OcclusionPatch patch;
  patch.columns = nodes_for(width);
  patch.rows = nodes_for(height);
  patch.first_node = out_.patch_nodes;
  patch.corner = middle - 0.5 * width * (R_ * right) - 0.5 * height * (R_ * up);
  patch.along_columns = width / (patch.columns - 1) * (R_ * right);
  patch.along_rows = height / (patch.rows - 1) * (R_ * up);
  patch.normal = facet.normal;
  out_.patch_nodes += patch.columns * patch.rows;
  facet.occlusion_patch = static_cast<std::int32_t>(out_.patches.size());
  out_.patches.push_back(patch);
  out_.facets.push_back(facet);

  std::array<std::uint32_t, 4> corners{};
  for (int i = 0; i < 4; ++i) {
    const double x = (i == 1 || i == 2) ? 0.5 : -0.5;
    const double y = i >= 2 ? 0.5 : -0.5;
    corners[static_cast<std::size_t>(i)] = vertex(middle + x * width * (R_ * right) + y * height * (R_ * up));
  }
  triangle(corners[0], corners[1], corners[2]);
  triangle(corners[0], corners[2], corners[3]);
}

void Builder::quadric(Quadric::Kind kind, const Eigen::Vector3d& centre, const Eigen::Vector3d& half_extent) {
  OcclusionPatch patch;
  patch.quadric = static_cast<std::int32_t>(out_.quadrics.size());
  patch.columns = std::max(9, nodes_for(2 * std::numbers::pi * half_extent.x()));
  patch.rows = kind == Quadric::Kind::sphere ? std::max(5, nodes_for(std::numbers::pi * half_extent.z()))
                                             : nodes_for(2 * half_extent.z());
  patch.first_node = out_.patch_nodes;
  out_.patch_nodes += patch.columns * patch.rows;
  out_.patch_of_quadric.push_back(static_cast<std::int32_t>(out_.patches.size()));
  out_.patches.push_back(patch);
  out_.quadrics.push_back(Quadric::make(kind, visual_.T_world_shape, centre, half_extent));
  const int pieces = out_.quadrics.back().pieces();
  const auto quadric_index = static_cast<std::uint32_t>(out_.quadrics.size() - 1);
  for (int i = 0; i < pieces; ++i)
    out_.quadric_pieces.push_back({quadric_index, 2.0 * i / pieces - 1, 2.0 * (i + 1) / pieces - 1});
  out_.visual_of_quadric.push_back(static_cast<std::int32_t>(index_));
  out_.quadric_casts_shadow.push_back(visual_.casts_shadow);
}

void Builder::operator()(const Mesh& mesh) {
  const TriangleMesh& data = *mesh.triangles;
  const bool mapped = visual_.material.image && data.texture_coordinates.size() == data.vertices.size();
  const auto first = static_cast<std::uint32_t>(out_.vertices.size());
  const double outward = mesh.scale.prod() < 0 ? -1 : 1;  // a mirror turns the order of the corners
  std::vector<Eigen::Vector3d> world(data.vertices.size());
  for (std::size_t i = 0; i < world.size(); ++i) {
    world[i] = visual_.T_world_shape * Eigen::Vector3d(mesh.scale.cwiseProduct(data.vertices[i]));
    vertex(world[i]);
  }
  for (const auto& corner : data.triangles) {
    const Eigen::Vector3d e1 = world[corner[1]] - world[corner[0]];
    const Eigen::Vector3d e2 = world[corner[2]] - world[corner[0]];
    const Eigen::Vector3d cross = e1.cross(e2);
    if (!(cross.norm() > 1e-12)) continue;  // no area: it hides nothing
    Facet facet;
    facet.normal = outward * cross.normalized();
    facet.offset = facet.normal.dot(world[corner[0]]);
    facet.visual = static_cast<std::int32_t>(index_);
    if (mapped) {
      // Gradients that reproduce the coordinates at the three corners and vanish across the plane.
      Eigen::Matrix3d rows;
      rows << e1.transpose(), e2.transpose(), facet.normal.transpose();
      const auto& uv = data.texture_coordinates;
      const Eigen::Matrix3d inverse = rows.inverse();
      const Eigen::Vector2d d1 = uv[corner[1]] - uv[corner[0]];
      const Eigen::Vector2d d2 = uv[corner[2]] - uv[corner[0]];
      facet.texture = affine(inverse * Eigen::Vector3d(d1.x(), d2.x(), 0),
                             inverse * Eigen::Vector3d(d1.y(), d2.y(), 0), world[corner[0]], uv[corner[0]]);
    } else {
      Eigen::Index axis = 0;
      (R_.transpose() * facet.normal).cwiseAbs().maxCoeff(&axis);
      facet.texture =
          metric_frame(Eigen::Vector3d::Unit(axis == 0 ? 1 : 0), Eigen::Vector3d::Unit(axis == 2 ? 1 : 2));
    }
    for (const std::uint32_t i : corner) out_.vertex_normals[first + i] += (outward * cross).cast<float>();
    out_.facets.push_back(facet);
    triangle(first + corner[0], first + corner[1], first + corner[2]);
  }
}

bool positive(const Eigen::Ref<const Eigen::VectorXd>& sizes) {
  return sizes.allFinite() && (sizes.array() > 0).all();
}

/// What is wrong with a shape's numbers; empty where nothing is.
std::string complaint(const Shape& shape) {
  struct Check {
    std::string operator()(const Box& b) const {
      return positive(b.size) ? "" : fmt::format("box size {} {} {}", b.size.x(), b.size.y(), b.size.z());
    }
    std::string operator()(const Ellipsoid& e) const {
      return positive(e.radii) ? "" : fmt::format("radii {} {} {}", e.radii.x(), e.radii.y(), e.radii.z());
    }
    std::string operator()(const Cylinder& c) const { return round(c.radius, c.length); }
    std::string operator()(const Capsule& c) const { return round(c.radius, c.length); }
    std::string operator()(const Rectangle& r) const {
      if (!(r.normal.norm() > 0) || !r.normal.allFinite()) return "a plane normal of length 0";
      return positive(r.size) ? "" : fmt::format("plane size {} {}", r.size.x(), r.size.y());
    }
    std::string operator()(const Mesh& m) const {
      return m.scale.allFinite() && (m.scale.array() != 0).all()
                 ? ""
                 : fmt::format("mesh scale {} {} {}", m.scale.x(), m.scale.y(), m.scale.z());
    }
    static std::string round(double radius, double length) {
      return positive(Eigen::Vector2d(radius, length)) ? ""
                                                       : fmt::format("radius {}, length {}", radius, length);
    }
  };
  return std::visit(Check{}, shape);
}

/// How far a visual is from the origin: its frame, or the nearest vertex of a mesh, whose frame says nothing.
double distance_from_origin(const Visual& visual) {
  const auto* mesh = std::get_if<Mesh>(&visual.shape);
  if (mesh == nullptr || mesh->triangles->vertices.empty()) return visual.T_world_shape.translation.norm();
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : mesh->triangles->vertices)
    nearest = std::min(nearest, (visual.T_world_shape * Eigen::Vector3d(mesh->scale.cwiseProduct(v))).norm());
  return nearest;
}

}  // namespace

std::optional<std::string> precision_warning(const World& world) {
  for (const Visual& visual : world.visuals) {
    const double distance = distance_from_origin(visual);
    if (!(distance > farthest_exact_place)) continue;
    return fmt::format(
        "visual '{}': found {:.0f} m from the origin of the world, where single precision makes depth "
        "inexact "
        "(beyond {:.0f} m): move the world to its origin",
        visual.name, distance, farthest_exact_place);
  }
  return std::nullopt;
}

Result<Geometry> Geometry::from(const World& world) {
  Geometry geometry;
  for (const Visual& visual : world.visuals) {
    if (const std::string found = complaint(visual.shape); !found.empty()) {
      return Error{fmt::format("visual '{}': found {}, expected positive numbers", visual.name, found)};
    }
    if (!visual.T_world_shape.is_finite()) {
      return Error{fmt::format("visual '{}': found a pose that is not finite", visual.name)};
    }
    if (const double distance = distance_from_origin(visual); !(distance <= farthest_place)) {
      return Error{
          fmt::format("visual '{}': found {:.0f} m from the origin of the world, expected at most {:.0f} m, "
                      "since rays are "
                      "of single precision: move the world to its origin",
                      visual.name, distance, farthest_place)};
    }
  }
  for (const bool casts_shadow : {true, false}) {
    for (std::size_t i = 0; i < world.visuals.size(); ++i) {
      const Visual& visual = world.visuals[i];
      if (visual.casts_shadow == casts_shadow) std::visit(Builder(geometry, visual, i), visual.shape);
    }
    if (casts_shadow) geometry.shadow_triangles = geometry.triangles.size();
  }
  return geometry;
}

}  // namespace pade::simulation
