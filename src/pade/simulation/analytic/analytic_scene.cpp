#include "pade/simulation/analytic/analytic_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pade/simulation/analytic/analytic_texture.hpp"

namespace pade::simulation {
namespace {

using Surface = AnalyticScene::Surface;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Entry {
  double t = kInfinity;
  int face = 0;
};

Entry enter(const HalfSpace& solid, const Surface& /*surface*/, const Eigen::Vector3d& origin,
            const Eigen::Vector3d& direction) {
  const double approach = solid.normal.dot(direction);
  if (!(approach < 0)) return {};
  return {solid.normal.dot(solid.point - origin) / approach, 0};
}

/// Slab method (Kay and Kajiya 1986), in the frame of the box.
Entry enter(const AnalyticBox& box, const Surface& surface, const Eigen::Vector3d& origin,
            const Eigen::Vector3d& direction) {
  const Eigen::Vector3d o = surface.R_shape_world * (origin - surface.centre);
  const Eigen::Vector3d d = surface.R_shape_world * direction;
  double first = -kInfinity;
  double last = kInfinity;
  int face = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > box.half_size[axis]) return {};
      continue;
    }
    const double side = d[axis] < 0 ? 1 : -1;  // the side on which the ray enters this slab
    const double in = (side * box.half_size[axis] - o[axis]) / d[axis];
    const double out = (-side * box.half_size[axis] - o[axis]) / d[axis];
    if (in > first) {
      first = in;
      face = 2 * axis + (side > 0 ? 1 : 0);
    }
    last = std::min(last, out);
  }
  if (!(first <= last)) return {};
  return {first, face};
}

Entry enter(const Sphere& ball, const Surface& /*surface*/, const Eigen::Vector3d& origin,
            const Eigen::Vector3d& direction) {
  const Eigen::Vector3d o = origin - ball.centre;
  const double a = direction.squaredNorm();
  const double b = o.dot(direction);
  if (!(b < 0)) return {};
  const double c = o.squaredNorm() - ball.radius * ball.radius;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return {};
  return {c / (-b + std::sqrt(discriminant)), 0};  // the smaller root, without cancellation
}

Eigen::Vector3d outward_normal(const Surface& surface, int face, const Eigen::Vector3d& point) {
  if (const auto* plane = std::get_if<HalfSpace>(&surface.shape)) return plane->normal;
  if (const auto* ball = std::get_if<Sphere>(&surface.shape)) return (point - ball->centre) / ball->radius;
  const double side = face % 2 == 1 ? 1 : -1;
  return side * surface.R_shape_world.row(face / 2).transpose();
}

double signed_distance_to(const HalfSpace& solid, const Surface& /*surface*/, const Eigen::Vector3d& point) {
  return solid.normal.dot(point - solid.point);
}

double signed_distance_to(const AnalyticBox& box, const Surface& surface, const Eigen::Vector3d& point) {
  const Eigen::Vector3d q = (surface.R_shape_world * (point - surface.centre)).cwiseAbs() - box.half_size;
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

double signed_distance_to(const Sphere& ball, const Surface& /*surface*/, const Eigen::Vector3d& point) {
  return (point - ball.centre).norm() - ball.radius;
}

/// Longest half-axis of the ellipse that the footprint parallelogram inscribes, and the length of the
/// shortest.
struct Footprint {
  Eigen::Vector3d major;
  double major_length = 0;
  double minor_length = 0;
};

Footprint principal_axes(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double centre = 0.5 * (uu + vv);
  const double radius = std::hypot(0.5 * (uu - vv), uv);
  const double angle = 0.5 * std::atan2(2 * uv, uu - vv);
  return {std::cos(angle) * u + std::sin(angle) * v, std::sqrt(centre + radius),
          std::sqrt(std::max(0.0, centre - radius))};
}

/// How much of the footprint is covered by panes, 0 to 1.
double pane_coverage(const Surface& surface, int face, const Eigen::Vector3d& point, const Eigen::Vector3d& u,
                     const Eigen::Vector3d& v) {
  const AnalyticMaterial& m = surface.material;
  if (!(m.pane_period_u > 0) || !std::holds_alternative<AnalyticBox>(surface.shape) || face / 2 == 2)
    return 0;
  const int across = face / 2 == 0 ? 1 : 0;  // upright faces: the horizontal axis in the face
  const Eigen::Vector3d q = surface.R_shape_world * (point - surface.centre);
  const Eigen::Vector3d width =
      (surface.R_shape_world * u).cwiseAbs() + (surface.R_shape_world * v).cwiseAbs();
  return filtered_square_wave(q[across], width[across], m.pane_period_u, m.pane_width) *
         filtered_square_wave(q[2], width[2], m.pane_period_v, m.pane_height);
}

/// Texture averaged over the footprint: a few probes along its longer axis, each as wide as the shorter one,
/// so that ground seen at a grazing angle keeps the texture that a camera would see across the line of sight.
double texture(const AnalyticMaterial& material, const Eigen::Vector3d& point, const Footprint& footprint) {
  constexpr double kMostProbes = 4;
  const double ratio = footprint.major_length / std::max(footprint.minor_length, 1e-12);
  const double probes = std::clamp(std::ceil(ratio - 0.5), 1.0, kMostProbes);
  const double width = std::max(footprint.minor_length, footprint.major_length / probes);
  double sum = 0;
  for (int i = 0; i < static_cast<int>(probes); ++i) {
    const Eigen::Vector3d probe = point + ((i + 0.5) / probes - 0.5) * footprint.major;
    sum += band_limited_noise(probe, material.coarsest, material.finest, width, material.seed);
  }
  return sum / probes;
}

}  // namespace

int AnalyticScene::add(std::string name, const AnalyticShape& shape, const AnalyticMaterial& material) {
  Surface surface{std::move(name), shape, material};
  if (const auto* box = std::get_if<AnalyticBox>(&shape)) {
    surface.R_shape_world = box->T_world_box.matrix3().transpose();
    surface.centre = box->T_world_box.translation;
  } else if (const auto* ball = std::get_if<Sphere>(&shape)) {
    surface.centre = ball->centre;
  }
  surfaces_.push_back(std::move(surface));
  return static_cast<int>(surfaces_.size()) - 1;
}

std::optional<RayHit> AnalyticScene::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                          double t_max) const {
  Entry nearest{t_max, 0};
  int surface = -1;
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const Entry entry = std::visit(
        [&](const auto& shape) { return enter(shape, surfaces_[i], origin, direction); }, surfaces_[i].shape);
    if (entry.t > 0 && entry.t < nearest.t) {
      nearest = entry;
      surface = static_cast<int>(i);
    }
  }
  if (surface < 0) return std::nullopt;
  const Eigen::Vector3d point = origin + nearest.t * direction;
  return RayHit{nearest.t, surface, nearest.face,
                outward_normal(surfaces_[static_cast<std::size_t>(surface)], nearest.face, point)};
}

double AnalyticScene::signed_distance(const Eigen::Vector3d& point) const {
  double nearest = kInfinity;
  for (const Surface& surface : surfaces_) {
    nearest = std::min(
        nearest, std::visit([&](const auto& shape) { return signed_distance_to(shape, surface, point); },
                            surface.shape));
  }
  return nearest;
}

double AnalyticScene::distance_to_surface(const Eigen::Vector3d& point) const {
  return std::abs(signed_distance(point));
}

double AnalyticScene::brightness(const RayHit& hit, const Eigen::Vector3d& point,
                                 const Eigen::Vector3d& footprint_u,
                                 const Eigen::Vector3d& footprint_v) const {
  const Surface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  const AnalyticMaterial& m = surface.material;
  const double panes = pane_coverage(surface, hit.face, point, footprint_u, footprint_v);
  double albedo = m.albedo + panes * (m.pane_albedo - m.albedo);
  if (m.contrast > 0) albedo *= 1 + m.contrast * texture(m, point, principal_axes(footprint_u, footprint_v));

  static const Eigen::Vector3d kSun = Eigen::Vector3d(-0.55, -0.35, 0.75).normalized();
  const double light = 0.55 + 0.30 * std::max(0.0, hit.normal.dot(kSun)) + 0.15 * hit.normal.dot(kSun);
  return std::clamp(albedo * 1.35 * light, 0.0, 1.0);
}

double AnalyticScene::sky_brightness(const Eigen::Vector3d& direction) {
  const double elevation = direction.z() / direction.norm();
  return 0.88 - 0.18 * std::clamp(elevation, 0.0, 1.0);
}

}  // namespace pade::simulation
