// When a ball whose centre moves along a straight line first meets a cube of the grid.
#pragma once

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pade::mapping {

/// A centre that moves from `start` along `direction` (unit, or zero at rest) for `length` metres.
struct BallPath {
  Eigen::Vector3d start;
  Eigen::Vector3d direction;
  double length = 0;
  double radius = 0;

  [[nodiscard]] Eigen::Vector3d at(double s) const { return start + s * direction; }
  /// Bounds of all that the ball covers.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;
  /// Squared distance of a point from the line that the centre moves along.
  [[nodiscard]] double squared_distance(const Eigen::Vector3d& point) const;
  /// The first place at which the centre is nearer than the radius to a box; empty if it never is. Exact: the
  /// squared distance is a parabola between the places where the line passes the planes of the box.
  [[nodiscard]] std::optional<double> first_contact(const Eigen::AlignedBox3d& box) const;
};

}  // namespace pade::mapping
