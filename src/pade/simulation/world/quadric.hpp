// Spheres, ellipsoids, cylinders and capsules as themselves, not as triangles: the ray equation in closed
// form.
#pragma once

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// A unit shape in its own coordinates: the sphere |p| = 1, or the tube x^2 + y^2 = 1, |z| <= 1 with or
/// without its two discs.
struct Quadric {
  enum class Kind { sphere, tube, cylinder };
  Kind kind = Kind::sphere;
  Eigen::Affine3d T_unit_world = Eigen::Affine3d::Identity();
  Eigen::Affine3d T_world_unit = Eigen::Affine3d::Identity();

  enum class Part { curved, cap };
  struct Hit {
    double distance;  ///< in lengths of the direction
    Part part;
  };

  /// The nearest hit in (nearest, farthest), from outside or inside; the world's ray, direction of any
  /// length.
  [[nodiscard]] std::optional<Hit> intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                             double nearest, double farthest) const;
  /// Outward unit normal in the world at a point of the surface.
  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector3d& unit_point, Part part) const;
  /// Of the part between two heights along the axis, -1 to 1; a sphere is whole.
  [[nodiscard]] Eigen::AlignedBox3d bounds(double from = -1, double to = 1) const;
  /// Into how many equal lengths a tree of boxes had best cut it: a rod across all axes fills little of its
  /// box.
  [[nodiscard]] int pieces() const;

  static Quadric make(Kind kind, const Pose& T_world_shape, const Eigen::Vector3d& centre,
                      const Eigen::Vector3d& half_extent);
};

}  // namespace pade::simulation
