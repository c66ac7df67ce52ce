#include "pade/simulation/truth.hpp"

#include <cmath>
#include <limits>

#include "pade/simulation/parallel.hpp"

namespace pade::simulation {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

void depth_row(const Scene& scene, const RayGrid& grid, const Eigen::Matrix3d& R,
               const Eigen::Vector3d& origin, int row, float* depth) {
  const int width = grid.camera().width;
  std::array<Eigen::Vector3d, ray_packet_size> directions;
  for (int first = 0; first < width; first += ray_packet_size) {
    RayPacket rays{};
    const int lanes = std::min(ray_packet_size, width - first);
    for (int lane = 0; lane < lanes; ++lane) {
      const Eigen::Vector2d& ray = grid.ray(first + lane, row);
      if (!(ray.x() == ray.x())) continue;
      auto& direction = directions[static_cast<std::size_t>(lane)];
      direction = R * Eigen::Vector3d(ray.x(), ray.y(), 1);
      rays.set(lane, origin, direction, 0, kInfinity);
    }
    const HitPacket hits = scene.nearest(rays);
    for (int lane = 0; lane < lanes; ++lane) {
      const auto i = static_cast<std::size_t>(lane);
      depth[first + lane] =
          hits.primitive[i].hit()
              ? static_cast<float>(scene.exact_distance(hits.primitive[i], origin, directions[i],
                                                        static_cast<double>(hits.distance[i])))
              : kNaN;
    }
  }
}

}  // namespace

cv::Mat exact_depth(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera, int threads) {
  cv::Mat depth(grid.camera().size(), CV_32FC1);
  const Eigen::Matrix3d R = T_world_camera.matrix3();
  parallel_rows(depth.rows, threads, [&](int row) {
    depth_row(scene, grid, R, T_world_camera.translation, row, depth.ptr<float>(row));
  });
  return depth;
}

ExactFlow exact_flow(const Scene& scene, const RayGrid& grid, const cv::Mat& depth, const Pose& T_world_first,
                     const Pose& T_world_second, int threads) {
  // A surface hides itself at the rounding of its own distance.
  constexpr float kBeforeTheSurface = 1 - 1e-4F;
  constexpr double kFar = 1e5;
  const Camera& camera = grid.camera();
  ExactFlow out{cv::Mat(camera.size(), CV_32FC2), cv::Mat::zeros(camera.size(), CV_8UC1)};
  const Pose T_second_first = T_world_second.inverse() * T_world_first;
  const Eigen::Matrix3d R = T_second_first.matrix3();
  const Eigen::Matrix3d R_world_second = T_world_second.matrix3();
  parallel_rows(camera.height, threads, [&](int row) {
    for (int first = 0; first < camera.width; first += ray_packet_size) {
      RayPacket rays{};
      for (int lane = 0; lane < std::min(ray_packet_size, camera.width - first); ++lane) {
        const int column = first + lane;
        auto& flow = out.flow.at<cv::Vec2f>(row, column);
        flow = {kNaN, kNaN};
        const Eigen::Vector2d& ray = grid.ray(column, row);
        if (!(ray.x() == ray.x())) continue;
        const auto z = static_cast<double>(depth.at<float>(row, column));
        const bool sky = std::isnan(z);
        Eigen::Vector3d point = R * Eigen::Vector3d(ray.x(), ray.y(), 1);
        if (!sky) point = z * point + T_second_first.translation;
        const auto pixel = camera.project(point);
        if (!pixel) continue;
        flow = {static_cast<float>(pixel->x() - column), static_cast<float>(pixel->y() - row)};
        const bool inside = pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera.width - 1 &&
                            pixel->y() <= camera.height - 1;
        if (inside) {
          rays.set(lane, T_world_second.translation, R_world_second * point, 0,
                   sky ? static_cast<float>(kFar) : kBeforeTheSurface);
        }
      }
      const auto hidden = scene.occluded(rays, Scene::Blockers::everything);
      for (std::size_t i = 0; i < ray_packet_size; ++i) {
        if (rays.active[i] != 0 && !hidden[i]) {
          out.visible.at<std::uint8_t>(row, first + static_cast<int>(i)) = 255;
        }
      }
    }
  });
  return out;
}

}  // namespace pade::simulation
