// The occupancy map from above and from the side, and the way ahead, as SVG for the report.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// Widths of the drawings without their numbers, pixels.
struct MapLayout {
  double width = 640;  ///< across the page
  double half = 640;   ///< of two beside each other: views from above that are not much wider than high
  bool turn = false;   ///< turns the views from above if they would be higher than wide
};

/// The map with the camera's path over it.
struct MapScene {
  const mapping::OccupancyMap& map;
  const std::vector<Eigen::Vector3d>& trajectory;  ///< camera positions, world, metres
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();   ///< unit vector, world
  Eigen::Vector3d look = Eigen::Vector3d::Zero();  ///< optical axis at the last pose, world
  MapLayout layout{};
};

/// An <svg> per view with axes in metres and a scale bar. Voxels beyond the 0.2 and 99.8 % quantile of each
/// axis and away from the path are cut off, and counted. Empty if nothing is known or there is no path.
struct MapViews {
  std::string top;         ///< all obstacles seen from above, coloured by height
  std::string level;       ///< free, occupied and unknown at the height of the nearest point of the path
  std::string side;        ///< all obstacles seen level, along the shorter horizontal extent
  std::string section;     ///< free, occupied and unknown on the upright surface through the path and ahead
  std::string height_bar;  ///< the colours of top and side
  double side_stretch = 1, section_stretch = 1;  ///< how much heights are stretched there
  bool wide = false;                             ///< the views from above fill MapLayout::width, not half
  std::size_t cut_off = 0;                       ///< occupied voxels outside the pictures
};
MapViews draw_map(const MapScene& map);

inline constexpr double corridor_radius = 0.35;   ///< of the sphere, metres
inline constexpr double corridor_length = 15;     ///< metres
inline constexpr double corridor_half_width = 3;  ///< metres

/// Two sections along the flight direction from the last pose on (corridor.hpp): free, occupied and unknown.
/// Empty if there is no pose.
struct CorridorViews {
  std::string level, upright;
  double reach = std::numeric_limits<double>::quiet_NaN();   ///< known_free_reach() of the sphere, metres
  mapping::Occupancy stopped_by = mapping::Occupancy::free;  ///< what the sphere meets there
};
CorridorViews draw_corridor(const MapScene& map);

}  // namespace pade::evaluation
