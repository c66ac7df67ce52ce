// Which voxels a depth image shows occupied.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/pose.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/tiles/hit_grid.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::mapping {

/// A voxel that an image shows occupied.
struct HitVoxel {
  VoxelKey key{};
  std::uint64_t code = 0;   ///< Morton
  Eigen::Vector3d ray;      ///< from the camera to its centre, world, m
  double z = 0;             ///< of its centre, m
  float certainty = 0;      ///< probability that a point that was found in it belongs to it
  std::uint32_t count = 0;  ///< points in it
  float share = 0;          ///< of the pixels that it covers, those whose point it holds: at most 1
};

/// Most of the points of a voxel of at least this certainty are where they seem to be.
inline constexpr float kCertainly = 0.5F;
/// Of the standard normal distribution.
inline constexpr double kDensityAtMean = 0.3989;

/// Counts the points of an image per voxel and keeps the voxels that enough of their pixels agree on. Keeps
/// its buffers.
class HitFinder {
 public:
  explicit HitFinder(const MapOptions& options) : options_(options) {}

  /// @param image  as OccupancyMap::integrate() takes it. @param cells  the camera of its cells
  /// @param change  gets `too_uncertain` and `outside`
  void find(const DepthImage& image, const Camera& cells, const Pose& T_world_camera, MapChange& change);
  /// Of the last image, in Morton order.
  [[nodiscard]] const std::vector<HitVoxel>& voxels() const { return voxels_; }

 private:
  void count_points(const DepthImage& image, const Camera& cells, const Pose& T_world_camera,
                    MapChange& change);
  void spread_row(const float* own, int v, int count);
  void add_row(int count, bool is_spread, MapChange& change);
  [[nodiscard]] HitVoxel voxel_of(const VoxelKey& key, const HitGrid::Count& count, const Camera& cells,
                                  const Pose& T_world_camera) const;
  [[nodiscard]] bool is_hit(const HitVoxel& voxel, const HitGrid::Around& around) const;

  MapOptions options_;
  HitGrid grid_;
  std::vector<HitVoxel> voxels_;
  std::vector<double> z_;                 // of a row, m; NaN = no point
  std::vector<std::uint64_t> keys_;       // of a row
  std::vector<std::uint32_t> certainty_;  // of a row
};

}  // namespace pade::mapping
