// What a map knows of the way ahead at the moment when the vehicle asks: the free corridor, how far a sphere
// may fly, and the obstacles about the direction of flight. docs/map-evaluation.md defines every measure.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/evaluation/map/map_accuracy.hpp"
#include "pade/evaluation/map/surface.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// A world of known geometry.
struct TrueWorld {
  Surface surface;
  /// Whether a point (world, m) lies inside a closed shape.
  std::function<bool(const Eigen::Vector3d&)> inside_solid;
};

struct ViewAheadOptions {
  double corridor_radius = 0.5;      ///< m
  double corridor_truly_free = 0.9;  ///< of a shell's voxels, for the frame to count there
  double sphere_radius = 0.35;       ///< m
  double sphere_start = 0.6;  ///< the sphere's first centre ahead of the camera; nearer voxels are exempt, m
  double farthest = 12;       ///< of the corridor and of the sphere, m
  AheadOptions surface;
};

/// A length of the corridor ahead, from..to metres from the camera. A frame counts where the shell is truly
/// free to the stated share and the line of flight meets no surface before its far end.
struct Shell {
  int from = 0, to = 0;
  std::size_t frames = 0;      ///< that count
  double known_free = 0;       ///< of its truly free voxels: mean over these frames
  double called_occupied = 0;  ///< of its truly free voxels: mean over these frames
};

/// Percentiles over the frames, metres.
struct Reach {
  std::size_t frames = 0;
  double p10 = 0, median = 0;
  double true_p10 = 0, true_median = 0;  ///< of the way that truly is free
  std::size_t past_surface = 0;          ///< frames in which the map lets the sphere fly into a surface
};

struct ViewAheadResult {
  std::size_t frames = 0;     ///< that were asked
  std::vector<Shell> shells;  ///< one per metre
  Reach reach;
  AheadShares surface;  ///< with the map as it was at each frame
};

/// Asks a map after each frame that it was fed with.
class ViewAhead {
 public:
  /// `world` must outlive it.
  explicit ViewAhead(const TrueWorld& world, const ViewAheadOptions& options = {});

  /// @param T_map_camera    where the map was told that the camera is
  /// @param T_world_camera  where it truly is: truth is laid over the map camera on camera
  /// @param direction       of flight, in camera coordinates, any length but 0
  /// @param exact_depth     of the true camera, CV_32FC1, metres; NaN = none. Empty: `surface` is not counted
  void add(const mapping::OccupancyMap& map, const Pose& T_map_camera, const Pose& T_world_camera,
           const Eigen::Vector3d& direction, const cv::Mat& exact_depth, const Camera& camera);
  [[nodiscard]] ViewAheadResult result() const;

 private:
  struct Line;
  void add_corridor(const mapping::OccupancyMap& map, const Line& line);
  void add_reach(const mapping::OccupancyMap& map, const Line& line);

  const TrueWorld& world_;
  ViewAheadOptions options_;
  ViewAheadResult sums_;
  std::vector<double> reaches_, true_reaches_;
};

}  // namespace pade::evaluation
