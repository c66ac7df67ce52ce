#include "frame_content.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <pade/mapping/back_projection.hpp>

namespace pade_ros {
namespace {

/// Without what the map would not take for an obstacle: too far, or too uncertain.
cv::Mat usable_depth(const pade::DepthImage& image, const pade::mapping::MapOptions& options) {
  cv::Mat depth = image.depth.clone();
  for (int row = 0; row < depth.rows; ++row) {
    auto* const z = depth.ptr<float>(row);
    const auto* const variance = image.variance.empty() ? nullptr : image.variance.ptr<float>(row);
    for (int column = 0; column < depth.cols; ++column) {
      const auto d = static_cast<double>(z[column]);
      const double sigma = variance == nullptr ? 0 : std::sqrt(static_cast<double>(variance[column]));
      if (!(d <= options.range) || sigma > options.hit_max_relative_sigma * d)
        z[column] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return depth;
}

std::vector<CloudPoint> cloud_of(const pade::MapperUpdate& update, const pade::Camera& camera,
                                 const cv::Mat& image, const NodeOptions& options) {
  pade::DepthImage usable;
  usable.time = update.depth.time;
  usable.window = update.depth.window;
  usable.depth = usable_depth(update.depth, options.mapper.map);
  usable.variance = update.depth.variance;
  const int step = std::max(1, options.cloud_step / std::max(1, usable.window));
  std::vector<CloudPoint> out;
  for (const pade::CloudPoint& point :
       pade::mapping::back_project(usable, camera, update.reference.T_world_camera, image, step)) {
    out.push_back(
        {point.x, point.y, point.z, point.sigma, point.colour[0], point.colour[1], point.colour[2]});
  }
  return out;
}

}  // namespace

void CameraPath::add(const PathPose& pose) {
  constexpr std::size_t kMostPoses = 1000;
  if (left_out_++ % step_ == 0) poses_.push_back(pose);
  if (poses_.size() <= kMostPoses) return;
  std::vector<PathPose> half;
  for (std::size_t i = 0; i < poses_.size(); i += 2) half.push_back(poses_[i]);
  poses_ = std::move(half);
  step_ *= 2;
}

FrameResult frame_content(const pade::MapperUpdate& update, const pade::Camera& camera, const cv::Mat& image,
                          pade::Time time, const Wanted& wanted, const NodeOptions& options) {
  FrameResult out;
  out.stamp = update.depth.time.nanoseconds;
  pade::DepthImage whole;
  whole.depth = update.depth.depth;
  whole.variance = update.depth.variance;
  if (update.depth.window > 1) whole = pade::at_full_size(update.depth, camera.size());
  const auto z =
      std::make_shared<const cv::Mat>(whole.depth.isContinuous() ? whole.depth : whole.depth.clone());
  out.width = z->cols;
  out.height = z->rows;
  out.depth = z->ptr<float>();
  out.owner = z;
  if (wanted.sigma) {
    cv::Mat sigma;
    cv::sqrt(whole.variance, sigma);
    out.sigma.assign(sigma.begin<float>(), sigma.end<float>());
  }
  if (wanted.cloud) {
    const bool same = update.depth.time == time;  // else the depth belongs to an older frame
    out.cloud = cloud_of(update, camera, same ? image : update.reference.image, options);
  }
  return out;
}

}  // namespace pade_ros
