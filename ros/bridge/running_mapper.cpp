// Of the mapper's thread: from a frame and its pose to the map and to what is told of it.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <pade/mapping/query/map_border.hpp>

#include "diagnoses.hpp"
#include "running.hpp"

namespace pade_ros {
namespace {

using pade::MapperUpdate;
using pade::ObstacleMapper;
using pade::Pose;
using pade::seconds_between;
using pade::Time;

double share_with_depth(const pade::DepthImage& image) {
  if (image.empty()) return 0;
  const cv::Mat known = image.depth == image.depth;  // NaN is not equal to itself
  return static_cast<double>(cv::countNonZero(known)) / static_cast<double>(image.depth.total());
}

}  // namespace

void Running::begin_anew(const std::string& why) {
  mapper_.reset();
  path_.begin_anew();
  last_ = {};
  origin_.setZero();
  const bool lost_something = mapped_anew_ > 0;
  mapped_anew_ = 0;
  {
    const std::lock_guard lock(mutex_);
    counts_.origin = "0 0 0";
    counts_.outside_now = 0;
    if (view_) {
      view_.reset();
      view_new_ = true;
    }
    if (!lost_something) return;
    ++counts_.restarts;
    counts_.last_restart = why;
  }
  come_.notify_all();
  sink_.log(Diagnosis::warning, fmt::format("the map is begun anew: {}", why));
}

/// Where a map from the origin would end around the camera, another is begun around it.
void Running::keep_within_the_map(const Eigen::Vector3d& place) {
  if (!pade::mapping::is_near_the_border(place - origin_, options_.mapper.map.voxel)) return;
  begin_anew("the camera came near the border of what a map can hold");
  origin_ = place;
  const std::string text = fmt::format("{:.2f} {:.2f} {:.2f}", origin_.x(), origin_.y(), origin_.z());
  {
    const std::lock_guard lock(mutex_);
    counts_.origin = text;
  }
  sink_.log(Diagnosis::warning,
            fmt::format("the map's 0 0 0 is {} m of that of the poses ({}): its frame is {}", text,
                        poses_->world(), map_world()));
}

/// Of the motion since the last frame that was mapped.
pade::Matrix6d Running::motion_covariance(Time time) {
  const bool first = last_.nanoseconds == 0;
  if (!first) {
    if (const auto known = poses_->covariance(pose_time(last_), pose_time(time))) return *known;
  }
  pade::Matrix6d covariance = pade::Matrix6d::Zero();
  const double way = first ? 0 : options_.velocity_sigma * std::clamp(seconds_between(last_, time), 0.0, 1.0);
  covariance.diagonal().head<3>().setConstant(way * way);
  covariance.diagonal().tail<3>().setConstant(options_.rotation_sigma * options_.rotation_sigma);
  return covariance;
}

/// The map as it is now goes to whoever publishes it.
void Running::take_view(Time time, const pade::mapping::MapChange& change) {
  std::shared_ptr<const pade::mapping::MapView> view;
  {
    const std::lock_guard lock(mutex_);
    view = view_;
  }
  view = view ? view->after(mapper_->map(), change) : pade::mapping::MapView::of(mapper_->map());
  const std::string world = map_world();
  const std::lock_guard lock(mutex_);
  view_ = std::move(view);
  view_stamp_ = time.nanoseconds;
  view_world_ = world;
  view_new_ = true;
  ever_mapped_ = true;
}

/// What nobody has seen again for so long as MapOptions::forget_after says, where a frame is not mapped.
void Running::forget(Time time) {
  if (!mapper_ || mapped_anew_ == 0) return;
  const pade::mapping::MapChange change = mapper_->forget(time);
  if (!change.touched.empty()) take_view(time, change);
}

void Running::map_frame(const WaitingFrame& frame, const PoseReply& reply) {
  const double begin = steady_seconds();
  std::shared_ptr<const Eye> eye;
  {
    const std::lock_guard lock(mutex_);
    eye = eye_;
  }
  if (!eye) return skip("camera_info is unusable");
  if (mapped_eye_ && eye != mapped_eye_) begin_anew("camera_info has changed");
  mapped_eye_ = eye;
  const auto image = undistorted(frame.message, *eye);
  if (!image) return skip(image.error().message);
  keep_within_the_map(reply.T_world_camera.translation);
  if (!mapper_) {
    auto made = ObstacleMapper::create(eye->lens.undistorted(), options_.mapper, eye->undistort.valid());
    if (!made) return skip(made.error().message);
    mapper_.emplace(std::move(*made));
  }
  const Time time{frame.message.stamp};
  const Pose T_map_camera{reply.T_world_camera.rotation, reply.T_world_camera.translation - origin_};
  const MapperUpdate& update = mapper_->add(*image, time, T_map_camera, motion_covariance(time));
  if (update.outcome == MapperUpdate::Outcome::skipped) {
    if (mapped_anew_ > 0 && !update.change.touched.empty()) take_view(time, update.change);  // what it forgot
    forget(time);
    return skip(kind_of(update.reason));
  }
  last_ = time;
  ++mapped_anew_;
  const bool mapped = update.outcome == MapperUpdate::Outcome::mapped;
  if (mapped) {
    take_view(time, update.change);
    tell(frame, reply, update, *image);
  }
  const double end = steady_seconds();
  const std::lock_guard lock(mutex_);
  counts_.mapped.tick(end);
  if (!mapped) return;
  counts_.outside_now = update.change.outside;
  counts_.outside += update.change.outside;
  counts_.depth_share = share_with_depth(update.depth);
  if (counts_.depth_share >= options_.least_depth) counts_.last_depth = end;
  counts_.latency.add(end - frame.arrival);
  counts_.work.add(end - begin);
  busy_ = busy_ > 0 ? 0.7 * busy_ + 0.3 * (end - begin) : end - begin;
  counts_.stamps.clear();
  if (const auto& offset = mapper_->health().stamp_offset; offset && offset->is_certain())
    counts_.stamps =
        fmt::format("the images' stamps are {:.1f} ms {}: add {:.4f} to time_offset",
                    1e3 * std::abs(offset->seconds), offset->seconds < 0 ? "late" : "early", offset->seconds);
  come_.notify_all();
}

void Running::tell(const WaitingFrame& frame, const PoseReply& reply, const MapperUpdate& update,
                   const cv::Mat& image) {
  const Time time{frame.message.stamp};
  FrameResult out = frame_content(update, mapper_->camera(), image, time, sink_.wanted(), options_);
  out.world_frame = map_world();
  out.camera_frame = camera_frame(frame.message);
  out.pose_stamp = time.nanoseconds;
  out.poses_frame = poses_->world();
  out.origin = {origin_.x(), origin_.y(), origin_.z()};
  out.body_frame = reply.body_frame;
  out.T_world_body = placement_of(reply.T_world_body);
  path_.add({time.nanoseconds, placement_of(mapper_->T_world_camera())});
  out.path = &path_.poses();
  sink_.frame(out);
}

}  // namespace pade_ros
