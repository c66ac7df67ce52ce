#include "pade/mapping/cloud_builder.hpp"

#include <cmath>

#include "pade/core/option_check.hpp"
#include "pade/mapping/back_projection.hpp"

namespace pade::mapping {
namespace {

/// 21 bits per axis: a million cubes to either side of the origin, 50 km at 5 cm.
std::uint64_t cube_of(const CloudPoint& point, double spacing) {
  constexpr std::int64_t kOffset = 1 << 20;
  constexpr std::uint64_t kMask = (1U << 21) - 1;
  const auto cell = [&](float value) {
    return static_cast<std::uint64_t>(
               static_cast<std::int64_t>(std::floor(static_cast<double>(value) / spacing)) + kOffset) &
           kMask;
  };
  return cell(point.x) << 42 | cell(point.y) << 21 | cell(point.z);
}

}  // namespace

Status check(const CloudOptions& o) {
  const OptionRange ranges[] = {
      {"spacing", o.spacing, 0.001, 1000},
      {"largest_relative_sigma", o.largest_relative_sigma, 0},
      {"step", static_cast<double>(o.step), 1, 65536},
  };
  return check_ranges(ranges);
}

void CloudBuilder::add(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                       const cv::Mat& intensity) {
  const Eigen::Vector3d axis = T_world_camera.rotation * Eigen::Vector3d::UnitZ();
  for (const CloudPoint& point : back_project(image, camera, T_world_camera, intensity, options_.step)) {
    const double depth = axis.dot(Eigen::Vector3d(point.x, point.y, point.z) - T_world_camera.translation);
    if (!(static_cast<double>(point.sigma) <= options_.largest_relative_sigma * depth)) continue;
    const auto [entry, is_new] = index_.try_emplace(cube_of(point, options_.spacing), cloud_.size());
    if (is_new) {
      cloud_.push_back(point);
    } else if (point.sigma < cloud_[entry->second].sigma) {
      cloud_[entry->second] = point;
    }
  }
}

}  // namespace pade::mapping
