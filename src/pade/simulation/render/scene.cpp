#include "pade/simulation/render/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include "pade/simulation/render/ambient_occlusion.hpp"

namespace pade::simulation {
namespace {

constexpr unsigned kTriangles = 0;  // geometry ids
constexpr unsigned kShadowlessTriangles = 1;
constexpr unsigned kQuadrics = 2;
constexpr unsigned kSeen = 1;  // ray masks
constexpr unsigned kCastsShadow = 2;

void quadric_bounds(const RTCBoundsFunctionArguments* args) {
  const auto& geometry = *static_cast<const Geometry*>(args->geometryUserPtr);
  const Geometry::QuadricPiece& piece = geometry.quadric_pieces[args->primID];
  const Eigen::AlignedBox3d box = geometry.quadrics[piece.quadric].bounds(piece.from, piece.to);
  // Outward by a rounding step, since the bounds are single precision.
  const auto below = [](double x) {
    return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::max());
  };
  const auto above = [](double x) {
    return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::max());
  };
  args->bounds_o->lower_x = below(box.min().x());
  args->bounds_o->lower_y = below(box.min().y());
  args->bounds_o->lower_z = below(box.min().z());
  args->bounds_o->upper_x = above(box.max().x());
  args->bounds_o->upper_y = above(box.max().y());
  args->bounds_o->upper_z = above(box.max().z());
}

std::optional<Quadric::Hit> hit_quadric(const Quadric& quadric, RTCRayN* ray, unsigned n, unsigned i) {
  return quadric.intersect({RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)},
                           {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)},
                           RTCRayN_tnear(ray, n, i), RTCRayN_tfar(ray, n, i));
}

void quadric_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& geometry = *static_cast<const Geometry*>(args->geometryUserPtr);
  const Quadric& quadric = geometry.quadrics[geometry.quadric_pieces[args->primID].quadric];
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    if (const auto found = hit_quadric(quadric, ray, args->N, i)) {
      RTCRayN_tfar(ray, args->N, i) = static_cast<float>(found->distance);
      RTCHitN_primID(hit, args->N, i) = args->primID;
      RTCHitN_geomID(hit, args->N, i) = args->geomID;
      RTCHitN_instID(hit, args->N, i, 0) = args->context->instID[0];
    }
  }
}

void quadric_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& geometry = *static_cast<const Geometry*>(args->geometryUserPtr);
  const std::uint32_t index = geometry.quadric_pieces[args->primID].quadric;
  const Quadric& quadric = geometry.quadrics[index];
  const bool casts_shadow = geometry.quadric_casts_shadow[index];
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    if (!casts_shadow && (RTCRayN_mask(args->ray, args->N, i) & kSeen) == 0) continue;
    if (hit_quadric(quadric, args->ray, args->N, i)) {
      RTCRayN_tfar(args->ray, args->N, i) = -std::numeric_limits<float>::infinity();
    }
  }
}

struct Device {
  RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  RTCScene scene = nullptr;
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

/// Lanes `first` and on of a packet, as many as `ray` has.
template <class Ray>
void fill(Ray& ray, const RayPacket& rays, std::size_t first, unsigned mask) {
  constexpr std::size_t kLanes = std::extent_v<decltype(ray.org_x)>;
  const auto copy = [first](auto& to, const RayPacket::Lanes& from) {
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), kLanes, std::begin(to));
  };
  copy(ray.org_x, rays.origin_x);
  copy(ray.org_y, rays.origin_y);
  copy(ray.org_z, rays.origin_z);
  copy(ray.dir_x, rays.direction_x);
  copy(ray.dir_y, rays.direction_y);
  copy(ray.dir_z, rays.direction_z);
  copy(ray.tnear, rays.nearest);
  copy(ray.tfar, rays.farthest);
  std::fill_n(ray.time, kLanes, 0.0F);
  std::fill_n(ray.mask, kLanes, mask);
  std::fill_n(ray.id, kLanes, 0U);
  std::fill_n(ray.flags, kLanes, 0U);
}

RTCRay lane_of(const RayPacket& rays, std::size_t i, unsigned mask) {
  return {rays.origin_x[i],
          rays.origin_y[i],
          rays.origin_z[i],
          rays.nearest[i],
          rays.direction_x[i],
          rays.direction_y[i],
          rays.direction_z[i],
          0,
          rays.farthest[i],
          mask,
          0,
          0};
}

/// A plane seen edge on has no good intersection; its triangle was hit all the same, `about` there.
double plausible(double exact, double about) {
  return std::abs(exact - about) < 1e-3 * about ? exact : about;
}

RTCIntersectContext coherent_context() {
  RTCIntersectContext context{};
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

struct Scene::Implementation {
  World world;
  Geometry geometry;
  Device embree;
  std::size_t lanes = 1;  // rays that the machine traces together
  std::unique_ptr<AmbientOcclusion> occlusion;
  std::unique_ptr<Rasteriser> rasteriser;

  Status attach();
  void attach_triangles(unsigned id, std::size_t first, std::size_t last, unsigned mask) const;
  [[nodiscard]] HitPacket nearest(const RayPacket& rays) const;
  template <class RayHits, class Intersect>
  void intersect(const RayPacket& rays, std::size_t first, const Intersect& with, HitPacket& hits) const;
  [[nodiscard]] Primitive primitive(unsigned geometry_id, unsigned primitive_id) const;
};

void Scene::Implementation::attach_triangles(unsigned id, std::size_t first, std::size_t last,
                                             unsigned mask) const {
  if (first == last) return;
  RTCGeometry triangles = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), geometry.vertices.size()));
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), last - first));
  if (vertices != nullptr && corners != nullptr) {  // else Embree has noted the error, which attach() reads
    for (const auto& p : geometry.vertices) vertices = std::copy_n(p.data(), 3, vertices);
    for (std::size_t i = first; i < last; ++i)
      corners = std::copy_n(geometry.triangles[i].data(), 3, corners);
    rtcSetGeometryMask(triangles, mask);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(embree.scene, triangles, id);
  }
  rtcReleaseGeometry(triangles);
}

Status Scene::Implementation::attach() {
  if (embree.device == nullptr) {
    return Error{fmt::format("Embree: found error {} while starting, expected a device",
                             static_cast<int>(rtcGetDeviceError(nullptr)))};
  }
  const auto native = [this](RTCDeviceProperty width) {
    return rtcGetDeviceProperty(embree.device, width) != 0;
  };
  lanes = native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? 16
          : native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8
                                                              : 1;
  embree.scene = rtcNewScene(embree.device);
  rtcSetSceneFlags(embree.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(embree.scene, RTC_BUILD_QUALITY_HIGH);
  attach_triangles(kTriangles, 0, geometry.shadow_triangles, kSeen | kCastsShadow);
  attach_triangles(kShadowlessTriangles, geometry.shadow_triangles, geometry.triangles.size(), kSeen);
  if (!geometry.quadrics.empty()) {
    RTCGeometry quadrics = rtcNewGeometry(embree.device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(quadrics, static_cast<unsigned>(geometry.quadric_pieces.size()));
    rtcSetGeometryUserData(quadrics, &geometry);
    rtcSetGeometryBoundsFunction(quadrics, quadric_bounds, nullptr);
    rtcSetGeometryIntersectFunction(quadrics, quadric_intersect);
    rtcSetGeometryOccludedFunction(quadrics, quadric_occluded);
    rtcSetGeometryMask(quadrics, kSeen | kCastsShadow);
    rtcCommitGeometry(quadrics);
    rtcAttachGeometryByID(embree.scene, quadrics, kQuadrics);
    rtcReleaseGeometry(quadrics);
  }
  rtcCommitScene(embree.scene);
  if (const RTCError error = rtcGetDeviceError(embree.device); error != RTC_ERROR_NONE) {
    return Error{
        fmt::format("Embree: found error {} while building, expected none", static_cast<int>(error))};
  }
  occlusion =
      std::make_unique<AmbientOcclusion>(geometry, [this](const RayPacket& rays) { return nearest(rays); });
  return {};
}

Scene::Scene(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

Result<Scene> Scene::build(World world) {
  if (world.visuals.empty())
    return Error{fmt::format("world '{}': found nothing to see, expected a visual", world.name)};
  auto geometry = Geometry::from(world);
  if (!geometry) return geometry.error();
  Scene scene(std::make_unique<Implementation>());
  Implementation& inside = *scene.implementation_;
  inside.world = std::move(world);
  inside.geometry = std::move(geometry).value();
  if (const Status status = inside.attach(); !status) return status.error();
  inside.rasteriser = std::make_unique<Rasteriser>(inside.geometry);
  return scene;
}

const World& Scene::world() const { return implementation_->world; }
const Geometry& Scene::geometry() const { return implementation_->geometry; }
const Rasteriser& Scene::rasteriser() const { return *implementation_->rasteriser; }

HitPacket Scene::nearest(const RayPacket& rays) const { return implementation_->nearest(rays); }

Primitive Scene::Implementation::primitive(unsigned geometry_id, unsigned primitive_id) const {
  if (geometry_id == RTC_INVALID_GEOMETRY_ID) return {};
  if (geometry_id == kQuadrics)
    return {geometry.quadric_pieces[primitive_id].quadric | Primitive::quadric_bit};
  const bool late = geometry_id == kShadowlessTriangles;
  return {primitive_id + (late ? static_cast<std::uint32_t>(geometry.shadow_triangles) : 0U)};
}

template <class RayHits, class Intersect>
void Scene::Implementation::intersect(const RayPacket& rays, std::size_t first, const Intersect& with,
                                      HitPacket& hits) const {
  RTCIntersectContext context = coherent_context();
  RayHits packet;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled at once, and hot
  constexpr std::size_t kLanes = std::extent_v<decltype(packet.ray.org_x)>;
  fill(packet.ray, rays, first, kSeen);
  std::fill_n(packet.hit.geomID, kLanes, RTC_INVALID_GEOMETRY_ID);
  with(rays.active.data() + first, embree.scene, &context, &packet);
  for (std::size_t i = 0; i < kLanes; ++i) {
    hits.distance[first + i] = packet.ray.tfar[i];
    hits.primitive[first + i] =
        rays.active[first + i] == 0 ? Primitive{} : primitive(packet.hit.geomID[i], packet.hit.primID[i]);
  }
}

HitPacket Scene::Implementation::nearest(const RayPacket& rays) const {
  HitPacket hits;
  for (std::size_t first = 0; first < ray_packet_size; first += lanes) {
    if (lanes == 16) {
      intersect<RTCRayHit16>(rays, first, rtcIntersect16, hits);
    } else if (lanes == 8) {
      intersect<RTCRayHit8>(rays, first, rtcIntersect8, hits);
    } else {
      RTCIntersectContext context = coherent_context();
      RTCRayHit single{lane_of(rays, first, kSeen), {}};
      single.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      if (rays.active[first] != 0) rtcIntersect1(embree.scene, &context, &single);
      hits.distance[first] = single.ray.tfar;
      hits.primitive[first] = primitive(single.hit.geomID, single.hit.primID);
    }
  }
  return hits;
}

std::array<bool, ray_packet_size> Scene::occluded(const RayPacket& rays, Blockers blockers) const {
  const unsigned mask = blockers == Blockers::everything ? kSeen : kCastsShadow;
  const RTCScene scene = implementation_->embree.scene;
  RTCIntersectContext context = coherent_context();
  std::array<bool, ray_packet_size> hidden{};
  const auto trace = [&](auto&& packet, std::size_t first, const auto& with) {
    fill(packet, rays, first, mask);
    with(rays.active.data() + first, scene, &context, &packet);
    for (std::size_t i = 0; i < implementation_->lanes; ++i)
      hidden[first + i] = rays.active[first + i] != 0 && packet.tfar[i] < 0;
  };
  for (std::size_t first = 0; first < ray_packet_size; first += implementation_->lanes) {
    if (implementation_->lanes == 16) {
      trace(RTCRay16(), first, rtcOccluded16);
    } else if (implementation_->lanes == 8) {
      trace(RTCRay8(), first, rtcOccluded8);
    } else if (rays.active[first] != 0) {
      RTCRay single = lane_of(rays, first, mask);
      rtcOccluded1(scene, &context, &single);
      hidden[first] = single.tfar < 0;
    }
  }
  return hidden;
}

double Scene::distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RayPacket rays{};
  rays.set(0, origin, direction, 0, std::numeric_limits<float>::infinity());
  const HitPacket hits = nearest(rays);
  if (!hits.primitive[0].hit()) return std::numeric_limits<double>::quiet_NaN();
  return exact_distance(hits.primitive[0], origin, direction, static_cast<double>(hits.distance[0]));
}

double Scene::exact_distance(Primitive primitive, const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction, double about) const {
  const Geometry& geometry = implementation_->geometry;
  if (primitive.is_quadric()) {
    // Single precision blurs a grazing hit most; where the exact ray misses, the float is the best there is.
    const double slack = 1e-3 * about;
    const auto hit =
        geometry.quadrics[primitive.index()].intersect(origin, direction, about - slack, about + slack);
    return hit ? hit->distance : about;
  }
  const Facet& facet = geometry.facets[geometry.facet_of_triangle[primitive.index()]];
  return plausible((facet.offset - facet.normal.dot(origin)) / facet.normal.dot(direction), about);
}

VectorPacket::Lanes Scene::exact_distances(const HitPacket& hits, const Eigen::Vector3d& origin,
                                           const VectorPacket& directions) const {
  const Geometry& geometry = implementation_->geometry;
  VectorPacket::Lanes distances;
  const Facet* facet = nullptr;
  double offset = 0;  // from the origin, along the normal
  Primitive before;
  for (std::size_t i = 0; i < ray_packet_size; ++i) {
    const Primitive primitive = hits.primitive[i];
    const Eigen::Vector3d direction(directions.x[i], directions.y[i], directions.z[i]);
    const auto about = static_cast<double>(hits.distance[i]);
    if (!primitive.hit()) {
      distances[i] = std::numeric_limits<double>::quiet_NaN();
    } else if (primitive.is_quadric()) {
      distances[i] = exact_distance(primitive, origin, direction, about);
    } else {
      if (primitive != before) {  // neighbours mostly hit the same
        facet = &geometry.facets[geometry.facet_of_triangle[primitive.index()]];
        offset = facet->offset - facet->normal.dot(origin);
        before = primitive;
      }
      // The first triangle differs from `before`, which is none.
      const double exact =
          offset / facet->normal.dot(direction);  // NOLINT(clang-analyzer-core.CallAndMessage)
      distances[i] = plausible(exact, about);
    }
  }
  return distances;
}

std::uint32_t Scene::surface_id(Primitive primitive) const {
  if (!primitive.hit() || primitive.is_quadric()) return primitive.id;
  return implementation_->geometry.facet_of_triangle[primitive.index()];
}

SurfacePoint Scene::surface(Primitive primitive, const Eigen::Vector3d& position,
                            const Eigen::Vector3d& view_direction, bool with_occlusion) const {
  const Geometry& geometry = implementation_->geometry;
  SurfacePoint point;
  point.position = position;
  Eigen::Vector3d normal;
  if (primitive.is_quadric()) {
    const Quadric& quadric = geometry.quadrics[primitive.index()];
    point.visual = geometry.visual_of_quadric[primitive.index()];
    const Visual& visual = implementation_->world.visuals[static_cast<std::size_t>(point.visual)];
    const Eigen::Vector3d unit = quadric.T_unit_world * position;
    const bool cap = quadric.kind == Quadric::Kind::cylinder && unit.head<2>().squaredNorm() < 1 - 1e-5 &&
                     std::abs(unit.z()) > 1 - 1e-4;
    normal = quadric.normal(unit, cap ? Quadric::Part::cap : Quadric::Part::curved);
    const Eigen::Vector3d half(quadric.T_world_unit.linear().col(0).norm(),
                               quadric.T_world_unit.linear().col(1).norm(),
                               quadric.T_world_unit.linear().col(2).norm());
    const Eigen::Matrix3d axes = quadric.T_world_unit.linear() * half.cwiseInverse().asDiagonal();
    Eigen::Vector3d u = axes.col(0);
    Eigen::Vector3d v = axes.col(1);
    Eigen::Vector2d value(unit.x() * half.x(), unit.y() * half.y());
    if (!cap) {  // once around and along the axis
      const double angle = std::atan2(unit.y(), unit.x());
      const double radius = half.x() * std::max(unit.head<2>().norm(), 0.05);
      u = -std::sin(angle) * axes.col(0) + std::cos(angle) * axes.col(1);
      v = axes.col(2);
      value = {angle * radius, unit.z() * half.z()};
      if (quadric.kind == Quadric::Kind::sphere) {
        // Equal areas rather than equal angles: u shrinks toward the poles only as much as the texture would
        // tear.
        v = (v - normal * normal.dot(v)).normalized();
        value.y() = std::asin(std::clamp(unit.z(), -1.0, 1.0)) * half.z();
        value.x() = angle * half.x();
        u *= half.x() / radius;
      }
      if (visual.material.image) {
        u /= 2 * std::numbers::pi * radius;
        v /= -2 * half.z();
        value = {angle / (2 * std::numbers::pi) + 0.5, 0.5 - 0.5 * unit.z()};
      }
    } else if (visual.material.image) {
      u /= 2 * half.x();
      v /= -2 * half.y();
      value = {0.5 + 0.5 * unit.x(), 0.5 - 0.5 * unit.y()};
    }
    point.texture.gradient_u = u.cast<float>();
    point.texture.gradient_v = v.cast<float>();
    point.texture.u0 = static_cast<float>(value.x() - u.dot(position));
    point.texture.v0 = static_cast<float>(value.y() - v.dot(position));
  } else {
    const Facet& facet = geometry.facets[geometry.facet_of_triangle[primitive.index()]];
    point.visual = facet.visual;
    point.texture = facet.texture;
    normal = facet.normal;
  }
  if (normal.dot(view_direction) > 0) normal = -normal;
  point.normal = normal.cast<float>();
  if (with_occlusion) point.sky_view = implementation_->occlusion->sky_view(primitive, position);
  return point;
}

std::optional<std::string> Scene::inside_of(const Eigen::Vector3d& point) const {
  for (const Visual& visual : implementation_->world.visuals) {
    const Eigen::Vector3d p = visual.T_world_shape.inverse() * point;
    const bool inside = std::visit(
        [&](const auto& shape) {
          using S = std::decay_t<decltype(shape)>;
          if constexpr (std::is_same_v<S, Box>) {
            return (p.cwiseAbs().array() < 0.5 * shape.size.array()).all();
          } else if constexpr (std::is_same_v<S, Ellipsoid>) {
            return p.cwiseQuotient(shape.radii).squaredNorm() < 1;
          } else if constexpr (std::is_same_v<S, Cylinder>) {
            return p.head<2>().norm() < shape.radius && std::abs(p.z()) < 0.5 * shape.length;
          } else if constexpr (std::is_same_v<S, Capsule>) {
            const double along = std::clamp(p.z(), -0.5 * shape.length, 0.5 * shape.length);
            return (p - Eigen::Vector3d(0, 0, along)).norm() < shape.radius;
          } else {
            return false;
          }
        },
        visual.shape);
    if (inside) return visual.name;
  }
  return std::nullopt;
}

}  // namespace pade::simulation
