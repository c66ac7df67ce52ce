// A scene of half-spaces, boxes and spheres that is known in closed form: the oracle of the tests and the
// world of the sample flight. No mesh and no ray-tracing library; every ray is cast in double precision.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "pade/core/pose.hpp"

namespace pade::simulation {

/// How a surface reflects light. Everything is fixed to the surface: brightness does not depend on where the
/// camera is (Lambert's law under one distant sun), so that brightness constancy holds exactly.
struct AnalyticMaterial {
  double albedo = 0.55;    ///< mean reflectance, 0 to 1
  double contrast = 0.30;  ///< amplitude of the texture relative to the albedo; 0 = blank
  double coarsest = 1.2;   ///< lattice spacing of the coarsest octave of the texture, m
  double finest = 0.006;   ///< lattice spacing of the finest octave, m
  /// Dark panes on a grid in the first two axes of a box's face, as on a facade; period 0 = none.
  double pane_period_u = 0;  ///< m
  double pane_period_v = 0;  ///< m
  double pane_width = 0;     ///< m
  double pane_height = 0;    ///< m
  double pane_albedo = 0.18;
  std::uint32_t seed = 1;

  [[nodiscard]] bool textured() const { return contrast > 0; }
};

/// All points on the side of the plane away from its normal are solid.
struct HalfSpace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit length, out of the solid
};

/// A solid box of any orientation.
struct AnalyticBox {
  Pose T_world_box;                                           ///< origin at the centre
  Eigen::Vector3d half_size = Eigen::Vector3d::Constant(.5);  ///< m, each > 0
};

/// A solid ball.
struct Sphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 1;  ///< m, > 0
};

using AnalyticShape = std::variant<HalfSpace, AnalyticBox, Sphere>;

/// Where a ray first enters a solid.
struct RayHit {
  double t = 0;                                      ///< point = origin + t * direction
  int surface = 0;                                   ///< index into AnalyticScene::surfaces()
  int face = 0;                                      ///< box: 2 * axis + (outward normal is positive); else 0
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward, unit length
};

/// Solids in the world frame (ENU, metres) under a sky at infinity.
class AnalyticScene {
 public:
  struct Surface {
    std::string name;
    AnalyticShape shape;
    AnalyticMaterial material;
    // Derived once, for speed.
    Eigen::Matrix3d R_shape_world = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  };

  /// Adds a solid; returns its index.
  int add(std::string name, const AnalyticShape& shape, const AnalyticMaterial& material = {});

  [[nodiscard]] const std::vector<Surface>& surfaces() const { return surfaces_; }

  /// The first entry into a solid with 0 < t < t_max; empty = sky. The origin is taken to be in free space (a
  /// solid that contains it is not seen). `direction` need not be of unit length: with a camera ray (x/z,
  /// y/z, 1) t is the depth Z.
  [[nodiscard]] std::optional<RayHit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                           double t_max = std::numeric_limits<double>::infinity()) const;

  /// Distance to the nearest solid, negative inside. Exact outside; inside overlapping solids it is the depth
  /// in the solid in which the point lies deepest. Infinity where there is no solid.
  [[nodiscard]] double signed_distance(const Eigen::Vector3d& point) const;
  [[nodiscard]] double distance_to_surface(const Eigen::Vector3d& point) const;
  [[nodiscard]] bool inside_solid(const Eigen::Vector3d& point) const { return signed_distance(point) < 0; }

  /// Reflected brightness, 0 to 1, of a surface at a point, averaged over the footprint of a pixel: the
  /// parallelogram that `footprint_u` and `footprint_v` (world vectors, metres per pixel) span. Texture that
  /// is too fine for the footprint is left out, since a camera would alias it into motion that is not there.
  [[nodiscard]] double brightness(const RayHit& hit, const Eigen::Vector3d& point,
                                  const Eigen::Vector3d& footprint_u,
                                  const Eigen::Vector3d& footprint_v) const;

  /// Brightness of the sky in a world direction (any length): a smooth gradient that carries no texture.
  [[nodiscard]] static double sky_brightness(const Eigen::Vector3d& direction);

 private:
  std::vector<Surface> surfaces_;
};

}  // namespace pade::simulation
