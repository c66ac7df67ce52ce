// A route on its map, from above.
#pragma once

#include <span>
#include <string>

#include <Eigen/Core>

#include "pade/mapping/query/map_view.hpp"

namespace pade::evaluation {

/// An SVG picture seen along the z axis: of the heights that the ball passes, black where something is
/// occupied, white where something is free and nothing occupied, grey where all is unknown.
/// @param points   of the motion, world, m; at least one
/// @param corners  of the straight lines behind it, world, m
/// @param radius   of the ball, m
/// @param seconds  in which the ball moves along the points, which are equally far apart in time, again and
///                 again; 0 = it does not move
std::string route_picture(const mapping::MapView& view, std::span<const Eigen::Vector3d> points,
                          std::span<const Eigen::Vector3d> corners, double radius, double seconds = 0);

}  // namespace pade::evaluation
