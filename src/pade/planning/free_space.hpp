// What the local planner asks of a map: how far a ball gets.
#pragma once

#include <span>

#include <Eigen/Core>

namespace pade::planning {

/// Space that is free as far as somebody knows.
class FreeSpace {
 public:
  virtual ~FreeSpace() = default;
  /// How far a ball flies along a path (points in the world, m; straight between them) before it touches
  /// something that is occupied, or (unless `unknown_is_free`) unknown. Infinity where it touches nothing.
  [[nodiscard]] virtual double clear_length(std::span<const Eigen::Vector3d> path, double radius,
                                            bool unknown_is_free) const = 0;
};

}  // namespace pade::planning
