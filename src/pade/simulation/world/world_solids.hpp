// A world as a map sees it: its surface as triangles, and what lies inside of things.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/pose.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// The surface of all visuals, metres, world. Boxes, rectangles and meshes are exact. Ellipsoids, cylinders
/// and capsules become triangles whose corners lie on the shape; no point of it is farther than `deviation`
/// (m) from them.
std::vector<std::array<Eigen::Vector3d, 3>> surface_triangles(const World& world, double deviation = 0.001);

/// The closed shapes of a world: boxes, ellipsoids, cylinders, capsules, and the meshes in which each edge is
/// shared by two triangles that run along it in opposite directions. Other meshes and rectangles have no
/// inside.
class WorldSolids {
 public:
  explicit WorldSolids(const World& world);
  /// Whether a point (world, m) lies inside one of them. Of meshes: where their winding number is not 0.
  [[nodiscard]] bool inside(const Eigen::Vector3d& point) const;

 private:
  struct Solid {
    Eigen::AlignedBox3d bounds;  // in the frame of the shape
    Pose T_shape_world;
    Shape shape;
  };
  std::vector<Solid> solids_;
};

}  // namespace pade::simulation
