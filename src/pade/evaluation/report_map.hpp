// The occupancy map from above and from the side, as SVG for the report.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pade::evaluation {

/// The occupied voxels seen along one direction, coloured by height, with the camera's path over them.
struct MapScene {
  const std::vector<Eigen::Vector3f>& occupied;    ///< voxel centres, world, metres
  const std::vector<Eigen::Vector3d>& trajectory;  ///< camera positions, world, metres
  double voxel = 0.1;                              ///< metres
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();   ///< unit vector, world
};

/// An <svg> per view with axes in metres and a scale bar. Voxels beyond the 0.2 and 99.8 % quantile of each
/// axis and away from the path are cut off, and counted in the text below. Empty where nothing is occupied.
struct MapViews {
  std::string top;    ///< seen from above
  std::string slice;  ///< the same, only what is at the height of the path, half a metre around: obstacles
  std::string side;   ///< seen level, along the shorter horizontal extent
  std::string height_bar;  ///< the colours of both
  std::size_t cut_off = 0;
};
MapViews draw_map(const MapScene& map);

}  // namespace pade::evaluation
