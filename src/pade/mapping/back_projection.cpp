#include "pade/mapping/back_projection.hpp"

#include <algorithm>
#include <cmath>

namespace pade::mapping {
namespace {

std::array<std::uint8_t, 3> colour_at(const cv::Mat& intensity, double u, double v) {
  if (intensity.empty()) return {};
  const int column = std::clamp(static_cast<int>(std::lround(u)), 0, intensity.cols - 1);
  const int row = std::clamp(static_cast<int>(std::lround(v)), 0, intensity.rows - 1);
  if (intensity.channels() == 1) {
    const std::uint8_t grey = intensity.at<std::uint8_t>(row, column);
    return {grey, grey, grey};
  }
  const auto& bgr = intensity.at<cv::Vec3b>(row, column);
  return {bgr[2], bgr[1], bgr[0]};
}

}  // namespace

Camera camera_of_cells(const Camera& camera, int window) {
  Camera cells = camera.undistorted();
  cells.width = (camera.width + window - 1) / window;
  cells.height = (camera.height + window - 1) / window;
  cells.fx = camera.fx / window;
  cells.fy = camera.fy / window;
  // cell_centre(i, n) = i n + cell_centre(0, n)
  cells.cx = (camera.cx - cell_centre(0, window)) / window;
  cells.cy = (camera.cy - cell_centre(0, window)) / window;
  return cells;
}

PointCloud back_project(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                        const cv::Mat& intensity, int step) {
  PointCloud cloud;
  const Eigen::Matrix3d rotation = T_world_camera.matrix3();
  step = std::max(step, 1);
  for (int row = 0; row < image.depth.rows; row += step) {
    const auto* depth = image.depth.ptr<float>(row);
    const auto* variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(row);
    const double v = cell_centre(row, image.window);
    for (int column = 0; column < image.depth.cols; column += step) {
      const double z = depth[column];
      if (!(z > 0) || !std::isfinite(z)) continue;
      const double u = cell_centre(column, image.window);
      const Eigen::Vector3d point =
          rotation * Eigen::Vector3d((u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z) +
          T_world_camera.translation;
      CloudPoint& out = cloud.emplace_back();
      out.x = static_cast<float>(point.x());
      out.y = static_cast<float>(point.y());
      out.z = static_cast<float>(point.z());
      out.colour = colour_at(intensity, u, v);
      out.sigma = variance != nullptr ? std::sqrt(variance[column]) : 0.0F;
    }
  }
  return cloud;
}

}  // namespace pade::mapping
