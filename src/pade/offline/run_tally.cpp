#include "pade/offline/run_tally.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pade/core/compute/median.hpp"

namespace pade {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// σ of the direction of translation, per axis, degrees: what the covariance says across it.
double direction_sigma(const RelativeMotion& motion) {
  const double length = motion.t_reference_other.norm();
  if (!(length > 0)) return 90;
  const Eigen::Vector3d along = motion.t_reference_other / length;
  const Eigen::Matrix3d covariance = motion.covariance.topLeftCorner<3, 3>();
  const double across = covariance.trace() - along.dot(covariance * along);
  return std::min(90.0, kDegrees * std::sqrt(std::max(0.0, 0.5 * across)) / length);
}

}  // namespace

void RunTally::add(const MapperUpdate& update) {
  add_depths(update.depth);
  add_motion(update.motion);
  given_.points_outside += update.change.outside;
  given_.hits += update.change.hits;
}

void RunTally::add_depths(const DepthImage& depth) {
  const auto range = static_cast<float>(map_.range);
  const auto largest = static_cast<float>(map_.hit_max_relative_sigma * map_.hit_max_relative_sigma);
  for (int v = 0; v < depth.depth.rows; ++v) {
    const auto* z = depth.depth.ptr<float>(v);
    const auto* variance = depth.variance.empty() ? nullptr : depth.variance.ptr<float>(v);
    for (int u = 0; u < depth.depth.cols; ++u) {
      if (std::isnan(z[u])) continue;
      ++given_.depths;
      if (z[u] > range) {
        ++given_.depths_beyond;
      } else if (variance != nullptr && !(variance[u] <= largest * z[u] * z[u])) {
        ++given_.depths_uncertain;
      }
    }
  }
}

void RunTally::add_motion(const RelativeMotion& motion) {
  constexpr double kNear = 1;  // m
  const double baseline = motion.t_reference_other.norm();
  if (std::max(camera_.fx, camera_.fy) * baseline < kNear) ++still_;
  baselines_.push_back(baseline);
  if (motion.covariance.isZero(0)) return;
  rotation_sigmas_.push_back(kDegrees * std::sqrt(motion.covariance.bottomRightCorner<3, 3>().trace() / 3));
  direction_sigmas_.push_back(direction_sigma(motion));
}

io::MapSummary RunTally::map_summary(const mapping::OccupancyMap& map) const {
  io::MapSummary summary = given_;
  const auto counts = map.counts();
  summary.voxel = map_.voxel;
  summary.occupied_voxels = counts.occupied;
  summary.free_voxels = counts.free;
  return summary;
}

io::MotionSummary RunTally::motion_summary() const {
  const auto middle = [](std::vector<double> values) { return median(values, 0.0); };
  return {baselines_.size(),         still_, middle(baselines_), middle(rotation_sigmas_),
          middle(direction_sigmas_), {}};
}

}  // namespace pade
