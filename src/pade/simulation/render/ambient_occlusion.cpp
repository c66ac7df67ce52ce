#include "pade/simulation/render/ambient_occlusion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "pade/core/pose.hpp"

namespace pade::simulation {
namespace {

constexpr float kUnknown = -1;
constexpr double kReach = 3;    // metres: what is farther away darkens nothing
constexpr double kLift = 2e-3;  // metres off the surface, so that it does not hide itself
constexpr int kRays = 64;

/// Directions over the half sphere about +z with cosine density (Hammersley points, the same at every node: a
/// pattern that changes from node to node would show as blotches).
const std::array<Eigen::Vector3d, kRays>& hemisphere() {
  static const auto directions = [] {
    std::array<Eigen::Vector3d, kRays> d;
    for (unsigned i = 0; i < kRays; ++i) {
      double radical = 0;
      double digit = 0.5;
      for (unsigned bits = i; bits != 0; bits >>= 1, digit /= 2) radical += (bits & 1U) != 0 ? digit : 0;
      const double r = std::sqrt((i + 0.5) / kRays);
      const double angle = 2 * std::numbers::pi * radical;
      d[i] = {r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - r * r)};
    }
    // Neighbours in a packet should be neighbours in direction.
    std::sort(d.begin(), d.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return std::atan2(a.y(), a.x()) < std::atan2(b.y(), b.x());
    });
    return d;
  }();
  return directions;
}

/// Point and normal of a node on the curved side of a quadric.
void quadric_node(const Quadric& quadric, const OcclusionPatch& patch, int column, int row,
                  Eigen::Vector3d& position, Eigen::Vector3d& normal) {
  const double around = 2 * std::numbers::pi * column / (patch.columns - 1);
  const double along = static_cast<double>(row) / (patch.rows - 1);
  Eigen::Vector3d unit;
  if (quadric.kind == Quadric::Kind::sphere) {
    const double polar = std::numbers::pi * along;
    unit = {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), -std::cos(polar)};
  } else {
    unit = {std::cos(around), std::sin(around), 2 * along - 1};
  }
  position = quadric.T_world_unit * unit;
  normal = quadric.normal(unit, Quadric::Part::curved);
}

}  // namespace

AmbientOcclusion::AmbientOcclusion(const Geometry& geometry, NearestHit nearest)
    : geometry_(geometry), nearest_(std::move(nearest)) {
  const std::size_t count = static_cast<std::size_t>(geometry.patch_nodes) + geometry.vertices.size();
  values_ = std::make_unique<std::atomic<float>[]>(count);
  for (std::size_t i = 0; i < count; ++i) values_[i].store(kUnknown, std::memory_order_relaxed);
}

float AmbientOcclusion::trace(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const {
  const Eigen::Quaterniond turn = rotation_between(Eigen::Vector3d::UnitZ(), normal);
  const Eigen::Vector3d origin = position + kLift * normal;
  double closed = 0;
  for (std::size_t first = 0; first < kRays; first += ray_packet_size) {
    RayPacket rays;
    for (int lane = 0; lane < ray_packet_size; ++lane) {
      rays.set(lane, origin, turn * hemisphere()[first + static_cast<std::size_t>(lane)], 0,
               static_cast<float>(kReach));
    }
    const HitPacket hits = nearest_(rays);
    for (std::size_t lane = 0; lane < ray_packet_size; ++lane) {
      if (hits.primitive[lane].hit()) closed += 1 - static_cast<double>(hits.distance[lane]) / kReach;
    }
  }
  return static_cast<float>(1 - closed / kRays);
}

float AmbientOcclusion::node(const OcclusionPatch& patch, int column, int row) const {
  auto& value = values_[static_cast<std::size_t>(patch.first_node + row * patch.columns + column)];
  float known = value.load(std::memory_order_relaxed);
  if (known != kUnknown) return known;
  Eigen::Vector3d position = patch.corner + column * patch.along_columns + row * patch.along_rows;
  Eigen::Vector3d normal = patch.normal;
  if (patch.quadric >= 0) {
    quadric_node(geometry_.quadrics[static_cast<std::size_t>(patch.quadric)], patch, column, row, position,
                 normal);
  }
  known = trace(position, normal);
  value.store(known, std::memory_order_relaxed);
  return known;
}

float AmbientOcclusion::vertex(std::uint32_t index) const {
  auto& value = values_[static_cast<std::size_t>(geometry_.patch_nodes) + index];
  float known = value.load(std::memory_order_relaxed);
  if (known != kUnknown) return known;
  const auto& p = geometry_.vertices[index];
  Eigen::Vector3d normal = geometry_.vertex_normals[index].cast<double>();
  const double length = normal.norm();
  normal = length > 1e-12 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::UnitZ();
  known = trace({p[0], p[1], p[2]}, normal);
  value.store(known, std::memory_order_relaxed);
  return known;
}

float AmbientOcclusion::patch_value(const OcclusionPatch& patch, float column, float row) const {
  const float x = std::clamp(column, 0.0F, static_cast<float>(patch.columns - 1));
  const float y = std::clamp(row, 0.0F, static_cast<float>(patch.rows - 1));
  const int x0 = std::min(static_cast<int>(x), patch.columns - 2);
  const int y0 = std::min(static_cast<int>(y), patch.rows - 2);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float low = (1 - fx) * node(patch, x0, y0) + fx * node(patch, x0 + 1, y0);
  const float high = (1 - fx) * node(patch, x0, y0 + 1) + fx * node(patch, x0 + 1, y0 + 1);
  return (1 - fy) * low + fy * high;
}

float AmbientOcclusion::sky_view(Primitive primitive, const Eigen::Vector3d& position) const {
  if (primitive.is_quadric()) {
    const OcclusionPatch& patch =
        geometry_.patches[static_cast<std::size_t>(geometry_.patch_of_quadric[primitive.index()])];
    const Quadric& quadric = geometry_.quadrics[primitive.index()];
    const Eigen::Vector3d unit = quadric.T_unit_world * position;
    const double around = std::atan2(unit.y(), unit.x()) / (2 * std::numbers::pi);
    const double along = quadric.kind == Quadric::Kind::sphere
                             ? std::acos(std::clamp(-unit.z(), -1.0, 1.0)) / std::numbers::pi
                             : 0.5 * (unit.z() + 1);
    return patch_value(patch, static_cast<float>((around < 0 ? around + 1 : around) * (patch.columns - 1)),
                       static_cast<float>(along * (patch.rows - 1)));
  }
  const Facet& facet = geometry_.facets[geometry_.facet_of_triangle[primitive.index()]];
  if (facet.occlusion_patch >= 0) {
    const OcclusionPatch& patch = geometry_.patches[static_cast<std::size_t>(facet.occlusion_patch)];
    const Eigen::Vector3d from_corner = position - patch.corner;
    return patch_value(
        patch, static_cast<float>(from_corner.dot(patch.along_columns) / patch.along_columns.squaredNorm()),
        static_cast<float>(from_corner.dot(patch.along_rows) / patch.along_rows.squaredNorm()));
  }
  const auto& corner = geometry_.triangles[primitive.index()];
  const auto point = [&](std::size_t i) {
    const auto& p = geometry_.vertices[corner[i]];
    return Eigen::Vector3d(p[0], p[1], p[2]);
  };
  const Eigen::Vector3d a = point(0);
  const Eigen::Vector3d cross = (point(1) - a).cross(point(2) - a);
  const double area = cross.squaredNorm();
  const double v = std::clamp((point(1) - a).cross(position - a).dot(cross) / area, 0.0, 1.0);
  const double u = std::clamp((position - a).cross(point(2) - a).dot(cross) / area, 0.0, 1.0);
  return static_cast<float>((1 - u - v) * static_cast<double>(vertex(corner[0])) +
                            u * static_cast<double>(vertex(corner[1])) +
                            v * static_cast<double>(vertex(corner[2])));
}

}  // namespace pade::simulation
