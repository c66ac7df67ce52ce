#include "pade/evaluation/map/map_ceiling.hpp"

#include <utility>

namespace pade::evaluation {

Result<MapCeiling> MapCeiling::create(const mapping::MapOptions& options) {
  if (const auto map = mapping::OccupancyMap::create(options); !map) return map.error();
  return MapCeiling(options);
}

MapCeiling::MapCeiling(const mapping::MapOptions& options)
    : options_(options), tree_(std::make_unique<octomap::OcTree>(options.voxel)) {
  tree_->setProbHit(options.p_hit);
  tree_->setProbMiss(options.p_miss);
  tree_->setClampingThresMin(options.clamp_min);
  tree_->setClampingThresMax(options.clamp_max);
  tree_->setOccupancyThres(options.occupancy_threshold);
}

void MapCeiling::add(const cv::Mat& depth, const Camera& camera, const Pose& T_world_camera) {
  octomap::Pointcloud cloud;
  cloud.reserve(depth.total());
  const Eigen::Matrix3d R = T_world_camera.matrix3();
  for (int v = 0; v < depth.rows; ++v) {
    const auto* row = depth.ptr<float>(v);
    for (int u = 0; u < depth.cols; ++u) {
      if (!(row[u] > 0)) continue;
      const double z = row[u];
      const Eigen::Vector3d camera_point((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z);
      const Eigen::Vector3f point = (R * camera_point + T_world_camera.translation).cast<float>();
      cloud.push_back(point.x(), point.y(), point.z());
    }
  }
  const Eigen::Vector3f origin = T_world_camera.translation.cast<float>();
  tree_->insertPointCloud(cloud, octomap::point3d(origin.x(), origin.y(), origin.z()), options_.range, true,
                          true);
}

Result<mapping::OccupancyMap> MapCeiling::finish() {
  tree_->updateInnerOccupancy();
  tree_->prune();
  return mapping::OccupancyMap::create(options_, std::move(tree_));
}

}  // namespace pade::evaluation
