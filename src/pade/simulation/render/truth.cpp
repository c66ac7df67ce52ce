#include "pade/simulation/render/truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/core/compute/parallel.hpp"

namespace pade::simulation {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr int kSide = ray_packet_side;

/// Calls work(lane, column, row) for the pixels of a tile that lie in the image and have a ray.
template <class Work>
void over_tile(const RayGrid& grid, int left, int top, const Work& work) {
  const Camera& camera = grid.camera();
  for (int lane = 0; lane < ray_packet_size; ++lane) {
    const int column = left + lane % kSide;
    const int row = top + lane / kSide;
    if (column >= camera.width || row >= camera.height) continue;
    const Eigen::Vector2d& ray = grid.ray(column, row);
    if (ray.x() == ray.x()) work(lane, column, row);
  }
}

/// The rays of a tile in the world; lanes outside the lens are left out, those outside the image repeat its
/// rim.
void tile_rays(const RayGrid& grid, const Eigen::Matrix3d& R, const Eigen::Vector3f& origin,
               const Eigen::Vector2d& offset, int left, int top, VectorPacket& directions, RayPacket& rays) {
  const Camera& camera = grid.camera();
  for (int lane = 0; lane < ray_packet_size; ++lane) {
    const int column = std::min(left + lane % kSide, camera.width - 1);
    const int row = std::min(top + lane / kSide, camera.height - 1);
    const auto i = static_cast<std::size_t>(lane);
    const Eigen::Vector2d ray = grid.ray(column, row) + grid.step(column, row) * offset;
    const Eigen::Vector3d direction = R * Eigen::Vector3d(ray.x(), ray.y(), 1);
    directions.x[i] = direction.x();
    directions.y[i] = direction.y();
    directions.z[i] = direction.z();
    rays.direction_x[i] = static_cast<float>(direction.x());
    rays.direction_y[i] = static_cast<float>(direction.y());
    rays.direction_z[i] = static_cast<float>(direction.z());
    rays.active[i] = ray.x() == ray.x() ? -1 : 0;
  }
  rays.origin_x.fill(origin.x());
  rays.origin_y.fill(origin.y());
  rays.origin_z.fill(origin.z());
  rays.nearest.fill(0);
  rays.farthest.fill(kInfinity);
}

void trace_tile(const Scene& scene, const RayGrid& grid, const Eigen::Matrix3d& R,
                const Eigen::Vector3d& origin, const Eigen::Vector2d& offset, int left, int top,
                VisibleSurface& out) {
  VectorPacket directions;
  RayPacket rays;
  tile_rays(grid, R, origin.cast<float>(), offset, left, top, directions, rays);
  const HitPacket hits = scene.nearest(rays);
  const VectorPacket::Lanes distances = scene.exact_distances(hits, origin, directions);
  const int columns = std::min(kSide, out.depth.cols - left);
  for (int y = 0; y < std::min(kSide, out.depth.rows - top); ++y) {
    auto* depth = out.depth.ptr<float>(top + y) + left;
    auto* primitive = out.primitive.ptr<std::int32_t>(top + y) + left;
    for (int x = 0; x < columns; ++x) {
      const auto lane = static_cast<std::size_t>(y * kSide + x);
      depth[x] = static_cast<float>(distances[lane]);
      primitive[x] = static_cast<std::int32_t>(hits.primitive[lane].id);
    }
  }
}

}  // namespace

VisibleSurface traced_surface(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera,
                              int threads, const Eigen::Vector2d& offset) {
  VisibleSurface out{cv::Mat(grid.camera().size(), CV_32SC1), cv::Mat(grid.camera().size(), CV_32FC1)};
  const Eigen::Matrix3d R = T_world_camera.matrix3();
  parallel_tiles(
      out.depth.cols, out.depth.rows, kSide, threads, [] { return 0; },
      [&](int, int left, int top) {
        trace_tile(scene, grid, R, T_world_camera.translation, offset, left, top, out);
      });
  return out;
}

VisibleSurface visible_surface(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera,
                               int threads, const Eigen::Vector2d& offset) {
  if (!grid.camera().is_pinhole()) return traced_surface(scene, grid, T_world_camera, threads, offset);
  Camera camera = grid.camera();
  camera.cx -= offset.x();
  camera.cy -= offset.y();
  return scene.rasteriser().draw(camera, T_world_camera, threads);
}

cv::Mat exact_depth(const Scene& scene, const RayGrid& grid, const Pose& T_world_camera, int threads) {
  return visible_surface(scene, grid, T_world_camera, threads).depth;
}

ExactFlow exact_flow(const Scene& scene, const RayGrid& grid, const cv::Mat& depth, const Pose& T_world_first,
                     const Pose& T_world_second, int threads) {
  // A surface hides itself at the rounding of its own distance.
  constexpr float kBeforeTheSurface = 1 - 1e-4F;
  constexpr double kFar = 1e5;
  const Camera& camera = grid.camera();
  ExactFlow out{cv::Mat(camera.size(), CV_32FC2, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN())),
                cv::Mat::zeros(camera.size(), CV_8UC1)};
  const Pose T_second_first = T_world_second.inverse() * T_world_first;
  const Eigen::Matrix3d R = T_second_first.matrix3();
  const Eigen::Matrix3d R_world_second = T_world_second.matrix3();
  parallel_tiles(
      camera.width, camera.height, kSide, threads, [] { return 0; },
      [&](int, int left, int top) {
        RayPacket rays{};
        over_tile(grid, left, top, [&](int lane, int column, int row) {
          const Eigen::Vector2d& ray = grid.ray(column, row);
          const auto z = static_cast<double>(depth.at<float>(row, column));
          const bool sky = std::isnan(z);
          Eigen::Vector3d point = R * Eigen::Vector3d(ray.x(), ray.y(), 1);
          if (!sky) point = z * point + T_second_first.translation;
          const auto pixel = camera.project(point);
          if (!pixel) return;
          out.flow.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel->x() - column),
                                                 static_cast<float>(pixel->y() - row)};
          const bool inside = pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera.width - 1 &&
                              pixel->y() <= camera.height - 1;
          if (inside) {
            rays.set(lane, T_world_second.translation, R_world_second * point, 0,
                     sky ? static_cast<float>(kFar) : kBeforeTheSurface);
          }
        });
        const auto hidden = scene.occluded(rays, Scene::Blockers::everything);
        over_tile(grid, left, top, [&](int lane, int column, int row) {
          const auto i = static_cast<std::size_t>(lane);
          if (rays.active[i] != 0 && !hidden[i]) out.visible.at<std::uint8_t>(row, column) = 255;
        });
      });
  return out;
}

}  // namespace pade::simulation
