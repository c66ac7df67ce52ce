// How far each pixel shows space to be free, with a pyramid over it that tells for a cube of space whether
// all of it, part of it or nothing of it is free.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/pose.hpp"
#include "pade/mapping/tiles/look_kernels.hpp"

namespace pade::mapping {

/// The free part of the viewing rays of one depth image: up to the bound, or to Z - k sigma where the image
/// has no bounds; at most the range.
class Clearance {
 public:
  struct Parameters {
    double range = 20;         ///< m along the optical axis
    double margin_sigmas = 2;  ///< k
    double hole = 0.05;        ///< a thing that is smaller than this is not looked for, m
    double voxel = 0.1;        ///< side of the smallest cube that will be asked about, m
  };

  /// `image` as OccupancyMap::integrate() takes it. Buffers are kept from call to call.
  void set(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
           const Parameters& parameters);

  /// A point of the world in the camera's frame, and a direction.
  [[nodiscard]] Eigen::Vector3d in_camera(const Eigen::Vector3d& point) const {
    return R_camera_world_ * (point - origin_);
  }
  [[nodiscard]] const Eigen::Matrix3d& R_camera_world() const { return R_camera_world_; }
  /// Of the camera, in the world.
  [[nodiscard]] const Eigen::Vector3d& origin() const { return origin_; }

  /// What answers for cubes of space, eight at once (tiles/look_kernels.hpp). Valid until set(), and as long
  /// as `levels` is.
  LookView for_voxels(std::vector<EndsLevel>& levels) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    int stride = 0;  // rows are longer, so that eight cells can be read from each
    std::vector<float> nearest;
    std::array<std::vector<float>, EndsLevel::kScales> farthest;  // from the level above its scale on
  };
  /// Neighbouring cells of a row that end before the same depth.
  struct Run {
    int row, first, last;
    std::int32_t hole;  // index of the run that stands for its hole: itself, or an earlier one
  };
  /// Runs that touch, also at corners.
  struct Hole {
    int left, right, top, bottom;
    bool sees_obstacle;
  };
  void close_holes(const cv::Mat& depth);
  [[nodiscard]] std::vector<std::pair<float, int>> hole_sizes() const;
  void rank_ends(const std::vector<std::pair<float, int>>& sizes);
  void find_holes(const cv::Mat& depth);
  void find_runs(std::uint8_t rank, int width, int height);
  void note_obstacles(const cv::Mat& depth, float end, int largest);
  [[nodiscard]] bool may_close(const Hole& hole, int largest) const;
  void join_above(std::size_t& above, std::size_t begin);
  [[nodiscard]] std::int32_t hole_of(std::int32_t run);
  void build_pyramid(int width, int height);
  void halve(std::size_t level);
  [[nodiscard]] const float* farthest(std::size_t level, std::size_t scale) const;

  Camera camera_;  // of the cells
  Parameters parameters_;
  Eigen::Matrix3d R_camera_world_;
  Eigen::Vector3d origin_;                    // of the camera, world
  Eigen::Vector3d reach_;                     // half extents of a cube of side 1 along the axes of the camera
  Eigen::Vector4d side_x_, side_y_, side_z_;  // inward normals of the viewing frustum's sides, camera
  Eigen::Vector4d side_reach_;                // half extents of a cube of side 1 along them
  std::vector<float> ends_, scratch_;         // where the free part of each cell's ray ends; 0 = unknown
  std::vector<std::uint8_t>
      ranks_;  // of each cell: the first of the hole sizes at whose depth it is not free
  std::vector<Run> runs_;
  std::vector<Hole> holes_;
  std::vector<Level> levels_;
};

}  // namespace pade::mapping
