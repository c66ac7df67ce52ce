// What the estimators are measured against: exact depth, exact optical flow, and which pixels the other frame
// sees.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/pose.hpp"
#include "pade/simulation/render/ray_grid.hpp"
#include "pade/simulation/render/scene.hpp"

namespace pade::simulation {

/// What is nearest at `offset` from the pixel centres (pixels right and down), found in single precision, and
/// its depth, computed again in double. Drawn triangle by triangle for a pinhole camera, by rays for any
/// other lens; the two differ in pixels within rounding of an edge.
VisibleSurface visible_surface(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera,
                               int threads = 1, const Eigen::Vector2d& offset = Eigen::Vector2d::Zero());
/// The same by rays for every camera.
VisibleSurface traced_surface(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera,
                              int threads = 1, const Eigen::Vector2d& offset = Eigen::Vector2d::Zero());

/// Depth of visible_surface(): along the optical axis at the pixel centres, CV_32FC1, metres; NaN where there
/// is nothing (sky, outside the lens).
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
