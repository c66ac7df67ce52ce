// From a depth image to points in the world (Eq. 3 of the paper, corrected: docs/mapping.md).
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/point_cloud.hpp"
#include "pade/core/pose.hpp"

namespace pade::mapping {

/// One point per measured cell: X = (u - cx) Z / fx, Y = (v - cy) Z / fy, Z, moved to the world. (u, v) is
/// the centre of the cell (cell_centre() where the image has windows). Row by row, so the order is that of
/// the image.
/// @param image           on the undistorted pixel grid of `camera`; cells without depth give no point
/// @param camera          pinhole (its distortion is ignored)
/// @param T_world_camera  metres
/// @param intensity       undistorted frame for the colours, CV_8UC1 or CV_8UC3 (BGR), at full size; empty =
/// black
/// @param step            takes every step-th cell of every step-th row, at least 1
PointCloud back_project(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                        const cv::Mat& intensity = {}, int step = 1);

/// The camera that sees the cells of n x n windows as its pixels: cell (i, j) has its centre at integer (i,
/// j).
Camera camera_of_cells(const Camera& camera, int window);

}  // namespace pade::mapping
