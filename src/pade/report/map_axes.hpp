// Two horizontal axes and up: how the pages look at a map.
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

namespace pade::evaluation {

/// Unit vectors, right-handed, and their names.
struct MapAxes {
  std::array<Eigen::Vector3d, 3> direction;  ///< world; the last is up
  std::array<std::string, 3> name;  ///< of the world's axes: "x", "−y"; "y′" where they are not quite
  /// A vector of the world along them.
  [[nodiscard]] std::array<double, 3> along(const Eigen::Vector3d& v) const {
    return {direction[0].dot(v), direction[1].dot(v), direction[2].dot(v)};
  }
};

/// @param up  unit vector, world
MapAxes map_axes(const Eigen::Vector3d& up);

}  // namespace pade::evaluation
