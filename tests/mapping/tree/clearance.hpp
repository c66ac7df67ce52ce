// How far each pixel shows space to be free, with a pyramid over it: tells for a cube of space whether all of
// it, part of it or nothing of it is free.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/pose.hpp"

namespace pade::mapping::tree {

/// What a depth image says about a cube.
enum class View {
  nothing,  ///< no voxel in it is shown free
  partly,   ///< look at its parts
  free,     ///< every point of it lies before what the pixels that look at it have measured
};

/// The free part of the viewing rays of one depth image: up to the bound, or to Z - k sigma where the image
/// has no bounds; at most the range.
class Clearance {
 public:
  struct Parameters {
    double range = 20;         ///< m along the optical axis
    double margin_sigmas = 2;  ///< k
    double hole = 0.05;        ///< a thing that is smaller than this is not looked for, m
    double voxel = 0.1;        ///< side of the smallest cube that look_at() will be asked about, m
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

  /// @param centre    of a cube along the axes of the world, in the camera's frame, metres
  /// @param side      metres
  /// @param is_voxel  a voxel is not divided further: the answer is `free` or `nothing`
  [[nodiscard]] View look_at(const Eigen::Vector3d& centre, double side, bool is_voxel) const;

 private:
  struct Extremes {
    float nearest;
    float farthest;
  };
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<Extremes> cells;
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
  void find_holes(const cv::Mat& depth, float end);
  void find_runs(float end, int width, int height);
  [[nodiscard]] std::int32_t hole_of(std::int32_t run);
  void drop_lone_ends(int width, int height);
  void build_pyramid(int width, int height);
  [[nodiscard]] Extremes over(int u0, int v0, int u1, int v1) const;

  Camera camera_;  // of the cells
  Parameters parameters_;
  Eigen::Matrix3d R_camera_world_;
  Eigen::Vector3d origin_;                    // of the camera, world
  Eigen::Vector3d reach_;                     // half extents of a cube of side 1 along the axes of the camera
  Eigen::Vector4d side_x_, side_y_, side_z_;  // inward normals of the viewing frustum's sides, camera
  Eigen::Vector4d side_reach_;                // half extents of a cube of side 1 along them
  std::vector<float> ends_, scratch_;         // where the free part of each cell's ray ends; 0 = unknown
  std::vector<Run> runs_;
  std::vector<Hole> holes_;
  std::vector<Level> levels_;
};

}  // namespace pade::mapping::tree
