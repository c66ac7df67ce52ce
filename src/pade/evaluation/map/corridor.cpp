#include "pade/evaluation/map/corridor.hpp"

#include <algorithm>
#include <cmath>

namespace pade::evaluation {
namespace {

/// From a point to the nearest point of the voxel with this centre.
double distance_to_voxel(const Eigen::Vector3d& point, const Eigen::Vector3d& centre, double voxel) {
  return ((point - centre).cwiseAbs().array() - 0.5 * voxel).max(0).matrix().norm();
}

/// The worst of what a sphere touches at `centre`, but for what it touches at `start`.
mapping::Occupancy worst_at(const mapping::OccupancyMap& map, const Eigen::Vector3d& centre,
                            const Eigen::Vector3d& start, double radius) {
  mapping::Occupancy worst = mapping::Occupancy::free;
  const double voxel = map.options().voxel;
  const Eigen::Vector3d low = ((centre.array() - radius) / voxel).floor();
  const Eigen::Vector3d high = ((centre.array() + radius) / voxel).floor();
  for (double x = low.x(); x <= high.x(); ++x) {
    for (double y = low.y(); y <= high.y(); ++y) {
      for (double z = low.z(); z <= high.z(); ++z) {
        const Eigen::Vector3d at = voxel * (Eigen::Vector3d(x, y, z).array() + 0.5);
        if (distance_to_voxel(centre, at, voxel) > radius) continue;
        if (distance_to_voxel(start, at, voxel) <= radius) continue;
        const mapping::Occupancy state = map.at(at);
        if (state == mapping::Occupancy::occupied) return state;
        if (state == mapping::Occupancy::unknown) worst = state;
      }
    }
  }
  return worst;
}

}  // namespace

FlightEnd end_of_flight(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector3d& look) {
  constexpr double kChord = 0.5, kShortest = 0.1;  // m
  const Eigen::Vector3d& end = path.back();
  const auto before = std::find_if(path.rbegin(), path.rend(), [&](const Eigen::Vector3d& point) {
    return (end - point).norm() >= kChord;
  });
  const Eigen::Vector3d way = end - (before != path.rend() ? *before : path.front());
  return {end, (way.norm() >= kShortest ? way : look).normalized()};
}

FreeReach known_free_reach(const mapping::OccupancyMap& map, const FlightEnd& from, double radius,
                           double farthest) {
  const double step = 0.25 * map.options().voxel;
  FreeReach reach;
  for (int i = 1; i * step <= farthest; ++i) {
    reach.stopped_by = worst_at(map, from.position + i * step * from.direction, from.position, radius);
    if (reach.stopped_by != mapping::Occupancy::free) break;
    reach.distance = i * step;
  }
  return reach;
}

cv::Mat slice_of(const mapping::OccupancyMap& map, const Eigen::Vector3d& corner,
                 const Eigen::Vector3d& right, const Eigen::Vector3d& down, cv::Size size) {
  cv::Mat states(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x)
      states.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(map.at(corner + x * right + y * down));
  }
  return states;
}

}  // namespace pade::evaluation
