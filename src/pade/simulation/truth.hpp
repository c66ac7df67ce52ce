// What the estimators are measured against: exact depth, exact optical flow, and which pixels the other frame
// sees.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/pose.hpp"
#include "pade/simulation/ray_grid.hpp"
#include "pade/simulation/scene.hpp"

namespace pade::simulation {

/// Depth along the optical axis at the pixel centres, CV_32FC1, metres; NaN where there is nothing (sky,
/// outside the lens). The ray is traced in single precision and the hit computed again in double.
cv::Mat exact_depth(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera, int threads = 1);

struct ExactFlow {
  cv::Mat
      flow;  ///< CV_32FC2, pixels: first(p) = second(p + flow); NaN where the second camera has no such pixel
  cv::Mat visible;  ///< CV_8UC1, 255 where the second frame shows the same surface point, else 0
};
/// Flow from the frame at `T_world_first`, whose depth is given, to the frame at `T_world_second`. Sky moves
/// as a point at infinity.
ExactFlow exact_flow(const Scene& scene, const RayGrid& grid, const cv::Mat& depth, const Pose& T_world_first,
                     const Pose& T_world_second, int threads = 1);

}  // namespace pade::simulation
