#include "pade/simulation/render/surface_distance.hpp"

#include <algorithm>
#include <cmath>

#include <embree3/rtcore.h>
#include <fmt/format.h>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
constexpr unsigned kFlat = 0;  // geometry ids
constexpr unsigned kRound = 1;

Vector3d corner(const Geometry& geometry, std::uint32_t triangle, std::size_t index) {
  const auto& v = geometry.vertices[geometry.triangles[triangle][index]];
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// The nearest point of a triangle, by the region of its plane that the point lies over (Ericson, "Real-Time
/// Collision Detection", 5.1.5).
double to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return (p - a).norm();
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return (p - b).norm();
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return (p - c).norm();
  const double over_c = d1 * d4 - d3 * d2;
  if (over_c <= 0 && d1 >= 0 && d3 <= 0) return (p - a - d1 / (d1 - d3) * ab).norm();
  const double over_b = d5 * d2 - d1 * d6;
  if (over_b <= 0 && d2 >= 0 && d6 <= 0) return (p - a - d2 / (d2 - d6) * ac).norm();
  const double over_a = d3 * d6 - d5 * d4;
  if (over_a <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return (p - b - (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b)).norm();
  const double whole = over_a + over_b + over_c;
  return (p - a - over_b / whole * ab - over_c / whole * ac).norm();
}

/// To an ellipsoid along the axes: the nearest point is (r_i^2 p_i / (t + r_i^2)) with the t that puts it on
/// the surface (Eberly, "Distance from a Point to an Ellipsoid"), found by bisection.
double to_ellipsoid(const Vector3d& point, const Vector3d& radii) {
  const Vector3d p = point.cwiseAbs().cwiseMax(1e-12 * radii);
  const Vector3d square = radii.cwiseAbs2();
  int least = 0;
  radii.minCoeff(&least);
  double low = -square[least] + radii[least] * p[least];
  double high = -square[least] + radii.cwiseProduct(p).norm();
  const auto scaled = [&](double t) -> Vector3d {
    return radii.cwiseProduct(p).cwiseQuotient((square.array() + t).matrix());
  };
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (scaled(middle).squaredNorm() > 1 ? low : high) = middle;
  }
  const double t = 0.5 * (low + high);
  return (square.cwiseProduct(p).cwiseQuotient((square.array() + t).matrix()) - p).norm();
}

double to_quadric(const Vector3d& point, const Quadric& quadric) {
  const Eigen::Matrix3d axes = quadric.T_world_unit.linear();
  const Vector3d half(axes.col(0).norm(), axes.col(1).norm(), axes.col(2).norm());
  const Vector3d p = half.cwiseProduct(quadric.T_unit_world * point);  // metres, in the axes of the shape
  if (quadric.kind == Quadric::Kind::sphere) {
    const bool ball = half.maxCoeff() - half.minCoeff() <= 1e-12 * half.maxCoeff();
    return ball ? std::abs(p.norm() - half.x()) : to_ellipsoid(p, half);
  }
  const double outward = p.head<2>().norm() - half.x();
  const double beyond = std::abs(p.z()) - half.z();
  const double side = std::hypot(outward, std::max(beyond, 0.0));
  if (quadric.kind == Quadric::Kind::tube) return side;
  return std::min(side, std::hypot(beyond, std::max(outward, 0.0)));  // a disc at each end
}

void round_bounds(const RTCBoundsFunctionArguments* args) {
  const auto& geometry = *static_cast<const Geometry*>(args->geometryUserPtr);
  const Geometry::QuadricPiece& piece = geometry.quadric_pieces[args->primID];
  const Eigen::AlignedBox3d box = geometry.quadrics[piece.quadric].bounds(piece.from, piece.to);
  constexpr float kMost = std::numeric_limits<float>::max();
  const auto below = [](double x) { return std::nextafter(static_cast<float>(x), -kMost); };
  const auto above = [](double x) { return std::nextafter(static_cast<float>(x), kMost); };
  *args->bounds_o = {below(box.min().x()), below(box.min().y()), below(box.min().z()), 0,
                     above(box.max().x()), above(box.max().y()), above(box.max().z()), 0};
}

struct Search {
  const Geometry& geometry;
  Vector3d point;
  double nearest;
};

bool look_at(RTCPointQueryFunctionArguments* args) {
  auto& search = *static_cast<Search*>(args->userPtr);
  const Geometry& geometry = search.geometry;
  const double distance =
      args->geomID == kFlat
          ? to_triangle(search.point, corner(geometry, args->primID, 0), corner(geometry, args->primID, 1),
                        corner(geometry, args->primID, 2))
          : to_quadric(search.point, geometry.quadrics[geometry.quadric_pieces[args->primID].quadric]);
  if (!(distance < search.nearest)) return false;
  search.nearest = distance;
  args->query->radius = static_cast<float>(distance) * (1 + 1e-6F) + 1e-5F;  // single precision never cuts
  return true;
}

}  // namespace

struct SurfaceDistance::Implementation {
  const Geometry& geometry;
  WorldSolids solids;
  RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  RTCScene scene = nullptr;

  explicit Implementation(const Scene& of) : geometry(of.geometry()), solids(of.world()) {}
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  ~Implementation() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  void attach_flat() const;
  void attach_round() const;
};

void SurfaceDistance::Implementation::attach_flat() const {
  if (geometry.triangles.empty()) return;
  RTCGeometry flat = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      flat, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), geometry.vertices.size()));
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      flat, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), geometry.triangles.size()));
  if (vertices != nullptr && corners != nullptr) {  // else Embree has noted the error, which build() reads
    for (const auto& p : geometry.vertices) vertices = std::copy_n(p.data(), 3, vertices);
    for (const auto& t : geometry.triangles) corners = std::copy_n(t.data(), 3, corners);
    rtcCommitGeometry(flat);
    rtcAttachGeometryByID(scene, flat, kFlat);
  }
  rtcReleaseGeometry(flat);
}

void SurfaceDistance::Implementation::attach_round() const {
  if (geometry.quadric_pieces.empty()) return;
  RTCGeometry round = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(round, static_cast<unsigned>(geometry.quadric_pieces.size()));
  // Embree's interface has no const; the bounds only read.
  rtcSetGeometryUserData(round, const_cast<Geometry*>(&geometry));  // NOLINT(*-const-cast)
  rtcSetGeometryBoundsFunction(round, round_bounds, nullptr);
  rtcCommitGeometry(round);
  rtcAttachGeometryByID(scene, round, kRound);
  rtcReleaseGeometry(round);
}

SurfaceDistance::SurfaceDistance(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;
SurfaceDistance::~SurfaceDistance() = default;

Result<SurfaceDistance> SurfaceDistance::build(const Scene& scene) {
  auto inside = std::make_unique<Implementation>(scene);
  if (inside->device != nullptr) {
    inside->scene = rtcNewScene(inside->device);
    inside->attach_flat();
    inside->attach_round();
    rtcCommitScene(inside->scene);
  }
  if (const RTCError error = rtcGetDeviceError(inside->device); error != RTC_ERROR_NONE) {
    return Error{fmt::format("Embree: found error {} while building the surface, expected none",
                             static_cast<int>(error))};
  }
  return SurfaceDistance(std::move(inside));
}

double SurfaceDistance::to(const Vector3d& point, double at_most) const {
  Search search{implementation_->geometry, point, at_most};
  RTCPointQuery query{};
  query.x = static_cast<float>(point.x());
  query.y = static_cast<float>(point.y());
  query.z = static_cast<float>(point.z());
  query.radius = static_cast<float>(at_most) * (1 + 1e-6F) + 1e-5F;
  RTCPointQueryContext context;  // NOLINT(cppcoreguidelines-pro-type-member-init): the next line does
  rtcInitPointQueryContext(&context);
  rtcPointQuery(implementation_->scene, &query, &context, look_at, &search);
  return search.nearest;
}

bool SurfaceDistance::inside(const Vector3d& point) const { return implementation_->solids.inside(point); }

}  // namespace pade::simulation
