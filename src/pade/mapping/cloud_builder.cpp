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

std::size_t CubeIndex::slot_of(std::uint64_t cube) const {
  std::uint64_t hash = cube * 0x9e3779b97f4a7c15ULL;  // golden ratio
  hash ^= hash >> 32U;
  std::size_t slot = hash & (slots_.size() - 1);
  while (slots_[slot] != 0 && cubes_[slots_[slot] - 1] != cube) slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

void CubeIndex::grow() {
  slots_.assign(slots_.empty() ? 1024 : 2 * slots_.size(), 0);
  for (std::size_t i = 0; i < cubes_.size(); ++i)
    slots_[slot_of(cubes_[i])] = static_cast<std::uint32_t>(i + 1);
}

std::size_t CubeIndex::place_of(std::uint64_t cube) {
  if (3 * (cubes_.size() + 1) > 2 * slots_.size()) grow();
  std::uint32_t& slot = slots_[slot_of(cube)];
  if (slot == 0) {
    cubes_.push_back(cube);
    slot = static_cast<std::uint32_t>(cubes_.size());
  }
  return slot - 1;
}

void CloudBuilder::add(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
                       const cv::Mat& intensity) {
  const Eigen::Vector3d axis = T_world_camera.rotation * Eigen::Vector3d::UnitZ();
  for (const CloudPoint& point : back_project(image, camera, T_world_camera, intensity, options_.step)) {
    const double depth = axis.dot(Eigen::Vector3d(point.x, point.y, point.z) - T_world_camera.translation);
    if (!(static_cast<double>(point.sigma) <= options_.largest_relative_sigma * depth)) continue;
    const std::size_t place = index_.place_of(cube_of(point, options_.spacing));
    if (place == cloud_.size()) {
      cloud_.push_back(point);
    } else if (point.sigma < cloud_[place].sigma) {
      cloud_[place] = point;
    }
  }
}

}  // namespace pade::mapping
