// The materials that every installation of Gazebo has, by their names in gazebo.material.
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace pade::simulation {

struct NamedColour {
  Eigen::Vector3d srgb;           ///< diffuse colour as the file gives it, 0 to 1
  bool stands_for_image = false;  ///< the material is an image that we do not have: its mean colour
};

/// The colour of "Gazebo/Orange" and its kin; empty for names that are not Gazebo's.
std::optional<NamedColour> gazebo_colour(std::string_view name);

}  // namespace pade::simulation
