#include "pade/live/dds/dds_poses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "pade/core/sensors/pose_jumps.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/live/link/bracket.hpp"
#include "pade/live/link/health.hpp"

namespace pade::live {
namespace {

constexpr double kPosesKept = 3;  // s

std::string_view message_type(PoseTopicType type) {
  switch (type) {
    case PoseTopicType::odometry:
      return "nav_msgs/Odometry";
    case PoseTopicType::pose:
      return "geometry_msgs/PoseStamped";
    case PoseTopicType::pose_with_covariance:
      return "geometry_msgs/PoseWithCovarianceStamped";
  }
  return "";
}

double heading(const Pose& T_world_body) {
  const Eigen::Vector3d ahead = T_world_body.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

}  // namespace

Result<std::unique_ptr<DdsPoses>> DdsPoses::open(DdsNetwork& network, DdsShared& shared,
                                                 const DdsOptions& options, const Pose& T_body_camera) {
  constexpr int kKept = 500;  // none is lost while the link's thread is away for a second
  auto reader = network.reader(options.poses, message_type(options.pose_type), kKept);
  if (!reader) return reader.error();
  return std::make_unique<DdsPoses>(std::move(*reader), shared, options, T_body_camera);
}

DdsPoses::DdsPoses(std::unique_ptr<TopicReader> reader, DdsShared& shared, const DdsOptions& options,
                   const Pose& T_body_camera)
    : reader_(std::move(reader)), shared_(shared), options_(options) {
  if (options.pose_of == PoseOf::camera) T_camera_body_ = T_body_camera.inverse();
}

void DdsPoses::refuse(std::string why) {
  problem_ = std::move(why);
  ++refused_;
}

void DdsPoses::jump() {
  samples_.clear();
  ++jumps_;
}

void DdsPoses::pull() {
  std::string message;
  while (reader_->take(message)) take(message);
}

void DdsPoses::take(std::string_view bytes) {
  const auto message =
      io::read_pose_message(message_type(options_.pose_type), bytes, io::MessageEncoding::cdr);
  if (!message) return refuse(message.error().message);
  const Eigen::Vector4d& q = message->xyzw;
  if (!message->position.allFinite() || !(std::abs(q.norm() - 1) < 0.01))
    return refuse(
        fmt::format("found a quaternion of length {:.3g} or a position that is not finite, expected "
                    "a pose",
                    q.norm()));
  const auto time = shared_.clock.to_ours(message->header.stamp);
  if (!time) return refuse("stamps of another clock (dds.clock)");
  if (const std::size_t restarts = shared_.clock.restarts(); restarts != clock_restarts_) {
    clock_restarts_ = restarts;
    if (!samples_.empty()) jump();
  }
  if (!samples_.empty() && frame_ != message->header.frame) jump();
  frame_ = message->header.frame;
  shared_.names.set_world(frame_);
  if (options_.pose_of == PoseOf::body) shared_.names.set_body(message->child);
  Pose pose;
  pose.translation = message->position;
  pose.rotation = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized();
  const Sample sample{*time, pose * T_camera_body_};
  if (!samples_.empty() && sample.time <= samples_.back().time) {
    if (seconds_between(sample.time, samples_.back().time) < 1)
      return refuse("a stamp is not later than the one before");
    jump();
  }
  if (jump_to(samples_, sample.time, sample.pose)) jump();
  samples_.push_back(sample);
  while (seconds_between(samples_.front().time, sample.time) > kPosesKept) samples_.pop_front();
  ++come_;
  problem_.clear();
}

PoseAnswer DdsPoses::at(Time time) {
  using Kind = PoseAnswer::Kind;
  pull();
  const Bracket found = bracket(samples_, time);
  if (found.kind != Kind::valid) return {found.kind, {}, found.why, jumps_};
  PoseAnswer answer{Kind::valid, samples_[found.after].pose, {}, jumps_};
  if (found.share < 1) {
    const Pose& before = samples_[found.after - 1].pose;
    Pose& pose = answer.T_world_body;
    pose.rotation = before.rotation.slerp(found.share, pose.rotation).normalized();
    pose.translation = (1 - found.share) * before.translation + found.share * pose.translation;
  }
  return answer;
}

Time DdsPoses::newest() {
  pull();
  return samples_.empty() ? Time{} : samples_.back().time;
}

double DdsPoses::turned_since(Time time) {
  const PoseAnswer then = at(time);
  if (then.kind != PoseAnswer::Kind::valid) return 0;
  return std::remainder(heading(then.T_world_body) - heading(samples_.back().pose), 2 * std::numbers::pi);
}

std::string DdsPoses::missing() {
  const Time last = newest();
  const bool any = last.nanoseconds != 0;
  if (any && seconds_between(last, shared_.clock.now()) - behind() < kStale) return {};
  if (!problem_.empty()) return fmt::format("{}: {}", options_.poses, problem_);
  const std::string why = reader_->remark();
  return why.empty() ? fmt::format("nothing on {}{}", options_.poses, any ? " any more" : "") : why;
}

std::string DdsPoses::summary() {
  std::string text = fmt::format("{} messages of {}", come_, options_.poses);
  if (refused_ > 0) text += fmt::format(", {} left out", refused_);
  if (refused_ > 0 && !problem_.empty()) text += fmt::format(" ({})", problem_);
  return text;
}

}  // namespace pade::live
