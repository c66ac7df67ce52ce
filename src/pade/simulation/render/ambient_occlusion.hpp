// How much of the sky's half sphere a surface point sees, kept on nodes that belong to the surface: it costs
// its rays once, and it cannot flicker from frame to frame.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "pade/simulation/render/scene.hpp"

namespace pade::simulation {

/// Values are computed when first asked for. Each depends on its node alone, so that threads may race for it
/// and the result is the same.
class AmbientOcclusion {
 public:
  using NearestHit = std::function<HitPacket(const RayPacket&)>;
  AmbientOcclusion(const Geometry& geometry, NearestHit nearest);

  /// 1 = open, 0 = closed in. Bilinear between the nodes of a patch, barycentric in a triangle without one.
  [[nodiscard]] float sky_view(Primitive primitive, const Eigen::Vector3d& position) const;

 private:
  [[nodiscard]] float patch_value(const OcclusionPatch& patch, float column, float row) const;
  [[nodiscard]] float node(const OcclusionPatch& patch, int column, int row) const;
  [[nodiscard]] float vertex(std::uint32_t index) const;
  [[nodiscard]] float trace(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const;

  const Geometry& geometry_;
  NearestHit nearest_;
  std::unique_ptr<std::atomic<float>[]> values_;  // patch nodes, then vertices; negative = not yet known
};

}  // namespace pade::simulation
