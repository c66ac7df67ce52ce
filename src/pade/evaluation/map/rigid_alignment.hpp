// The rigid motion that lays one set of camera poses on another.
#pragma once

#include <cstddef>
#include <vector>

#include "pade/core/pose.hpp"

namespace pade::evaluation {

struct RigidAlignment {
  Pose T_map_world;  ///< maps true poses to those of the map; the identity if they agree to 1 um
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< of the middle of the true path, metres
  double rotation = 0;                              ///< angle, rad
  double rms_position = 0;                          ///< what is left of the positions, metres
  double rms_rotation = 0;                          ///< what is left of the rotations, rad
  std::size_t poses = 0;                            ///< it was found from
};

/// The distance from the camera at which a turn counts as much as a shift, metres.
inline constexpr double alignment_lever = 4;

/// The pose T that minimises the sum over the pairs of |p_map - T p_true|^2 + L^2 / 2 |R_map - R R_true|_F^2:
/// in closed form, by the singular values of one matrix. The orientations settle what positions on a line
/// leave open. L is `alignment_lever`. Pose i of one list belongs to pose i of the other; both are
/// T_x_camera. Of empty lists: the identity.
RigidAlignment align(const std::vector<Pose>& T_map_camera, const std::vector<Pose>& T_world_camera);

/// T_map_world of one camera; the identity if the two poses agree to a micrometre and a microradian.
Pose registration(const Pose& T_map_camera, const Pose& T_world_camera);

}  // namespace pade::evaluation
