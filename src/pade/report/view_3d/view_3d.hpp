// A map in 3-D that one can turn with mouse, fingers and keys, as a piece of a page that needs nothing else.
// The drawing is view_3d.js, which the live page shows too.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pade/report/view_3d/voxel_list.hpp"

namespace pade::evaluation {

/// What it shows.
struct View3d {
  LeafSource leaves;                              ///< of the map; empty if there is none
  double voxel = 0;                               ///< side, m
  std::vector<Eigen::Vector3d> way;               ///< of the vehicle, world, m; may be empty
  std::vector<Eigen::Vector3d> plan;              ///< a path beside it, world, m; may be empty
  std::string plan_name = "planned path";         ///< plain text
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit vector, world
  bool is_enu = false;                            ///< y points north
  std::size_t most_cubes = 300'000;               ///< maps with more voxels are shown in larger cubes
};

/// A <figure>, with the sentence in it for who has no script or no WebGL 2. Empty where there is neither a
/// map nor a way. The page has view_3d_script() in a <script> behind the last of them.
std::string view_3d(const View3d& scene);
std::string_view view_3d_script();

}  // namespace pade::evaluation
