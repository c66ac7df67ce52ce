// How far a point of the world is from the nearest true surface, meshes included: what decides whether a
// vehicle has touched something.
#pragma once

#include <limits>
#include <memory>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/world/world_solids.hpp"

namespace pade::simulation {

/// The surface of a scene, which must outlive it. Queries change nothing and may run side by side.
class SurfaceDistance {
 public:
  /// Refuses what Embree refuses.
  static Result<SurfaceDistance> build(const Scene& scene);
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;
  ~SurfaceDistance();

  /// Distance from a point (world, m) to the nearest surface, in metres; `at_most` where none is nearer. Flat
  /// shapes and meshes to 1e-5 m (their corners are single precision), round ones to 1e-9 m. In a capsule
  /// also the inner halves of its two spheres count.
  [[nodiscard]] double to(const Eigen::Vector3d& point,
                          double at_most = std::numeric_limits<double>::infinity()) const;
  /// Whether the point lies inside a closed shape or a closed mesh (WorldSolids).
  [[nodiscard]] bool inside(const Eigen::Vector3d& point) const;
  /// Whether a ball about the point touches a surface or lies inside of something.
  [[nodiscard]] bool touches(const Eigen::Vector3d& point, double radius) const {
    return to(point, radius) < radius || inside(point);
  }

 private:
  struct Implementation;
  explicit SurfaceDistance(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pade::simulation
