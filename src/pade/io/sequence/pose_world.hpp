// What the poses of a flight tell about their world: which way is up, and a point near the flight.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <Eigen/Core>

#include "pade/core/pose.hpp"
#include "pade/io/world.hpp"

namespace pade::io {

/// The direction that points up, guessed from the cameras (T_world_camera, metres):
/// - if the positions lie on the Earth's surface in earth-centred coordinates, away from its centre;
/// - if the cameras look the same way but turn about it, as down-looking ones do, against their look;
/// - else the axis nearest to the mean of the cameras' up axes.
/// Empty if the cameras have no common direction, and if they move along their own vertical axis and
/// never turn: a camera that looks down in straight flight and one that looks ahead on the way up are the
/// same.
std::optional<WorldUp> guess_up(std::span<const Pose> cameras);

/// Whether `direction` lies within 45 degrees of the cameras' mean up axis, or of the opposite of their mean
/// look.
bool may_point_up(const Eigen::Vector3d& direction, std::span<const Pose> cameras);

/// Why guess_up() is empty, as a sentence for a person.
std::string why_no_up(std::span<const Pose> cameras);

/// A point near the flight in whole metres: the median of the positions, which a few wrong ones do not move.
Eigen::Vector3d near_flight(std::span<const Pose> cameras);

/// What SequenceOptions::origin asks for: the point of the pose world that becomes 0 0 0. With "auto"
/// near_flight() if that is farther than 1 km from 0 0 0 in any axis, else zero.
Eigen::Vector3d chosen_origin(const std::string& origin, std::span<const Pose> cameras);

/// `# frame=ENU origin=lat,lon,h` in the head of the folder's gnss.csv.
std::optional<GeographicOrigin> gnss_origin(const std::filesystem::path& folder);

}  // namespace pade::io
