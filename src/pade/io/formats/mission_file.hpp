// A route as a mission for an autopilot: the JSON `.plan` file of QGroundControl
// (https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html), which PX4 and ArduPilot
// take.
#pragma once

#include <span>
#include <string>

#include <Eigen/Core>

#include "pade/io/world.hpp"

namespace pade::io {

/// The content of a `.plan` file: one waypoint per corner. Heights are above the first corner (frame 3,
/// relative to home), since the map knows no geoid. Same corners, same bytes.
/// @param corners  east, north, up of the origin, m
/// @param speed    between waypoints, m/s
std::string encode_mission(std::span<const Eigen::Vector3d> corners, double speed,
                           const GeographicOrigin& origin);

}  // namespace pade::io
