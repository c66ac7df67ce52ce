// The world as rays see it: nearest hit and occlusion by Embree, sixteen coherent rays at a time, and the
// exact hit in double precision from the plane or the quadric that was hit.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/simulation/render/raster/rasteriser.hpp"
#include "pade/simulation/world/geometry.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// A packet sees a tile of 4 x 4 pixels: the rays of a square stay together longer than those of a row.
inline constexpr int ray_packet_side = 4;
inline constexpr int ray_packet_size = ray_packet_side * ray_packet_side;
/// Sixteen rays. With directions of Z = 1 in camera coordinates distances are depths along the optical axis.
struct RayPacket {
  using Lanes = std::array<float, ray_packet_size>;
  alignas(64) Lanes origin_x{}, origin_y{}, origin_z{}, direction_x{}, direction_y{},
      direction_z{}, nearest{}, farthest{};
  alignas(64) std::array<int, ray_packet_size> active{};  ///< -1 = trace, 0 = leave out

  void set(int lane, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float from, float to) {
    const auto i = static_cast<std::size_t>(lane);
    origin_x[i] = static_cast<float>(origin.x());
    origin_y[i] = static_cast<float>(origin.y());
    origin_z[i] = static_cast<float>(origin.z());
    direction_x[i] = static_cast<float>(direction.x());
    direction_y[i] = static_cast<float>(direction.y());
    direction_z[i] = static_cast<float>(direction.z());
    nearest[i] = from;
    farthest[i] = to;
    active[i] = -1;
  }
};

/// Sixteen vectors, axis by axis, in double precision.
struct VectorPacket {
  using Lanes = std::array<double, ray_packet_size>;
  alignas(64) Lanes x{}, y{}, z{};
};

struct HitPacket {
  alignas(64) std::array<float, ray_packet_size> distance{};
  std::array<Primitive, ray_packet_size> primitive;
};

/// Everything about the surface at a point that shading asks for.
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, toward the side that was asked from
  TextureFrame texture;                               ///< linear about the point
  std::int32_t visual = 0;
  float sky_view = 1;  ///< 1 - ambient occlusion
};

class Scene {
 public:
  /// Refuses worlds without a visual, shapes of impossible size, and what Embree refuses.
  static Result<Scene> build(World world);
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();

  [[nodiscard]] const World& world() const;
  [[nodiscard]] const Geometry& geometry() const;
  [[nodiscard]] const Rasteriser& rasteriser() const;

  [[nodiscard]] HitPacket nearest(const RayPacket& rays) const;
  enum class Blockers { everything, shadow_casters };
  /// For each lane: does anything of that kind lie in [nearest, farthest]?
  [[nodiscard]] std::array<bool, ray_packet_size> occluded(const RayPacket& rays, Blockers blockers) const;
  /// One ray, exact; NaN where it hits nothing.
  [[nodiscard]] double distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// The distance of a hit on `primitive` in double precision, from the float that the packet gave.
  [[nodiscard]] double exact_distance(Primitive primitive, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double about) const;
  /// The same for a packet of rays from one point; NaN in lanes that hit nothing.
  [[nodiscard]] VectorPacket::Lanes exact_distances(const HitPacket& hits, const Eigen::Vector3d& origin,
                                                    const VectorPacket& directions) const;
  /// Which flat or curved surface it is: equal for the two triangles of a face. Pixels shade once per
  /// surface.
  [[nodiscard]] std::uint32_t surface_id(Primitive primitive) const;
  /// Normal, texture coordinates and (where `with_occlusion`) ambient occlusion at a point of a primitive.
  [[nodiscard]] SurfacePoint surface(Primitive primitive, const Eigen::Vector3d& position,
                                     const Eigen::Vector3d& view_direction, bool with_occlusion) const;

  /// True if the point lies inside a closed shape (a box, an ellipsoid, a cylinder or a capsule), with the
  /// visual's name.
  [[nodiscard]] std::optional<std::string> inside_of(const Eigen::Vector3d& point) const;

 private:
  struct Implementation;
  explicit Scene(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pade::simulation
