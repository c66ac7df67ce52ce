// Obstacles in three dimensions as ArduPilot takes them: OBSTACLE_DISTANCE_3D from a map.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/live/sectors.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::live {

/// The nearest occupied voxels that a camera sees, one for each 4.5° of bearing and 5° of elevation that they
/// cover: so many that none is lost when they are turned before they are sent. What lies outside the image
/// does not count: what the map remembers there may be old.
/// @param T_world_body  world ENU, body FLU
/// @param camera        undistorted. @param T_body_camera  its mounting
/// @return points in the body's frame (FLU), m: in the direction of a part of the voxel, as near as its
/// nearest part and not nearer than options.min_distance; at most options.max_distance away. Empty where some
/// of what lies within reach is beyond what the map can address: "nothing is near" would then be a guess
std::optional<std::vector<Eigen::Vector3d>> obstacle_points(const mapping::MapView& view,
                                                            const Pose& T_world_body,
                                                            const SectorOptions& options,
                                                            const Camera& camera, const Pose& T_body_camera);

/// The nearest point for each face of ArduPilot's boundary (8 of 45° of bearing in 5 layers of 30°) as
/// messages in the body's frame, forward-right-down. Without points it is one message beyond `max_distance`:
/// there is no obstacle, and the sender is alive.
///
/// ArduPilot shows what came with one stamp when the next stamp comes. So that it does not lag by a frame the
/// messages are there twice, the second time with the next millisecond.
/// @param points  body FLU, m. @param time_boot_ms  another one for each frame, and not the next
std::vector<mavlink::ObstacleDistance3d> obstacle_messages(std::span<const Eigen::Vector3d> points,
                                                           std::uint32_t time_boot_ms,
                                                           const SectorOptions& options);

}  // namespace pade::live
