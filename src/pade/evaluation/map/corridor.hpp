// The way ahead of the last pose of a flight: how far the map knows it to be free.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// Where a flight ends and where it goes there.
struct FlightEnd {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< world, metres
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit vector, world; zero if nobody knows
};

/// The direction is that of the last half metre of the path; if the path is shorter than 10 cm, that of
/// `look`, the camera's optical axis.
/// @param path  camera positions, world, metres, in order of time, at least one
FlightEnd end_of_flight(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector3d& look);

/// How far a sphere gets, and what it meets there.
struct FreeReach {
  double distance = 0;                                       ///< of its centre from the start, metres
  mapping::Occupancy stopped_by = mapping::Occupancy::free;  ///< free if nothing stops it
};

/// How far the centre of a sphere can go straight on from `from`, until the sphere first meets a voxel that
/// is not known to be free (to a quarter of a voxel, at most `farthest` metres). Voxels that the sphere
/// touches where it starts count as free: the vehicle is there.
FreeReach known_free_reach(const mapping::OccupancyMap& map, const FlightEnd& from, double radius,
                           double farthest);

/// CV_8UC1 of mapping::Occupancy over a rectangle in space.
/// @param corner  centre of the top left pixel, world, metres
/// @param right   from a pixel to the next, metres
/// @param down    from a row to the next, metres
cv::Mat slice_of(const mapping::OccupancyMap& map, const Eigen::Vector3d& corner,
                 const Eigen::Vector3d& right, const Eigen::Vector3d& down, cv::Size size);

}  // namespace pade::evaluation
