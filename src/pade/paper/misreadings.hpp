// The paper's equations as printed where they cannot be right (docs/method.md, errata 1 to 4), so that what
// an erratum is worth can be measured by switching it off.
#pragma once

#include <array>
#include <string_view>
#include <utility>

#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"

namespace pade::experiment {

enum class Misreading {
  none,
  signs_of_eq1,       ///< t and omega of the camera put into Eq. 1 with the signs of the scene's motion
  sign_of_rotation,   ///< only the sign of Z put right: omega keeps the wrong one
  world_translation,  ///< p_{k+1} - p_k left in the world frame (Section 2.2)
  euler_difference,   ///< difference of roll, pitch and yaw in place of a rotation (Section 2.2)
  avionics_names,     ///< r_x = roll, r_y = pitch, r_z = yaw although x is to the right (Section 2.1)
  without_tz,         ///< Eq. 2 read as depth of the reference although it counts from the other camera
};

/// The motion that goes into the equations under `misreading`.
RelativeMotion misread(const RelativeMotion& motion, const Pose& T_world_reference, const Pose& T_world_other,
                       Misreading misreading);
/// Depth as read from the equations under `misreading`.
void misread(DepthImage& depth, const RelativeMotion& motion, Misreading misreading);

}  // namespace pade::experiment

template <>
struct pade::EnumNames<pade::experiment::Misreading> {
  using Misreading = pade::experiment::Misreading;
  static constexpr std::array names = {
      std::pair{Misreading::none, std::string_view("none")},
      std::pair{Misreading::signs_of_eq1, std::string_view("signs-of-eq1")},
      std::pair{Misreading::sign_of_rotation, std::string_view("sign-of-rotation")},
      std::pair{Misreading::world_translation, std::string_view("world-translation")},
      std::pair{Misreading::euler_difference, std::string_view("euler-difference")},
      std::pair{Misreading::avionics_names, std::string_view("avionics-names")},
      std::pair{Misreading::without_tz, std::string_view("without-tz")}};
};
