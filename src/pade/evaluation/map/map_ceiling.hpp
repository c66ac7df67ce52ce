// The ceiling of a map: OctoMap itself, fed with exact depth.
#pragma once

#include <memory>

#include <octomap/OcTree.h>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// OctoMap's insertPointCloud (one update per voxel and image) with the voxel, the range and the
/// probabilities of a run's map.
class MapCeiling {
 public:
  /// Refuses options that make no sense, as OccupancyMap does.
  static Result<MapCeiling> create(const mapping::MapOptions& options);
  /// @param depth  CV_32FC1, metres along the optical axis, NaN = none; of the pinhole `camera`
  void add(const cv::Mat& depth, const Camera& camera, const Pose& T_world_camera);
  /// The map; this has none any more.
  [[nodiscard]] Result<mapping::OccupancyMap> finish();

 private:
  explicit MapCeiling(const mapping::MapOptions& options);
  mapping::MapOptions options_;
  std::unique_ptr<octomap::OcTree> tree_;
};

}  // namespace pade::evaluation
