#include "pose_inputs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "sensor_poses.hpp"

namespace pade_ros {
namespace {

using pade::Pose;
using pade::seconds_between;
using pade::Time;

constexpr double kKept = 10;             // s
constexpr double kFarthestApart = 0.25;  // s, as `pade live` has it

/// nav_msgs/Odometry or geometry_msgs/PoseStamped.
class TopicPoses : public PoseInput {
 public:
  TopicPoses(const NodeOptions& options, std::string topic, Transforms& transforms)
      : options_(options), topic_(std::move(topic)), mounting_(options, transforms) {}

  void add(const PoseMessage& message) override {
    const std::lock_guard lock(mutex_);
    rate_.tick(steady_seconds());
    const Pose pose = pose_of(message.pose);
    if (!pose.is_finite() || std::abs(pose.rotation.norm() - 1) > 0.01) {
      ++unusable_;
      return;
    }
    const Time time{message.stamp};
    const std::string world = frame_name(message.frame);
    const std::string child = frame_name(message.child);
    if (!samples_.empty() && (world != world_ || child != child_)) {
      jump(fmt::format("the poses were of {} in {} and are of {} in {}", child_, world_, child, world));
    } else if (!samples_.empty() && seconds_between(time, samples_.back().time) > kClockWentBack) {
      jump(fmt::format("the stamps of the poses went back by {:.1f} s",
                       seconds_between(time, samples_.back().time)));
    } else if (const double off = unexpected(time, pose.translation); off > 0) {
      jump(fmt::format("the poses jumped by {:.2f} m", off));
    }
    world_ = world;
    child_ = child;
    if (!samples_.empty() && time <= samples_.back().time) {
      ++out_of_order_;
      return;
    }
    samples_.push_back({time, {pose.rotation.normalized(), pose.translation}});
    while (seconds_between(samples_.front().time, time) > kKept) samples_.pop_front();
  }

  PoseReply at(Time time, const std::string& camera) override {
    PoseReply reply;
    std::string child;
    Pose T_world_child;
    {
      const std::lock_guard lock(mutex_);
      reply.jumps = jumps_;
      reply.last_jump = last_jump_;
      if (!interpolate_at(time, T_world_child, reply)) return reply;
      child = child_.empty() ? frame_name(options_.base_frame) : child_;
    }
    const auto T_child_camera = mounting_.of(child, camera, time, reply);
    if (!T_child_camera) return reply;
    reply.kind = PoseReply::Kind::valid;
    reply.T_world_body = T_world_child;
    reply.T_world_camera = T_world_child * *T_child_camera;
    return reply;
  }

  void clear_after(Time now) override {
    const std::lock_guard lock(mutex_);
    if (!samples_.empty() && seconds_between(now, samples_.back().time) > kClockWentBack) samples_.clear();
  }

  std::string world() override {
    const std::lock_guard lock(mutex_);
    return options_.world_frame.empty() ? world_ : frame_name(options_.world_frame);
  }

  Diagnosis diagnose(double now) override {
    const std::lock_guard lock(mutex_);
    const char* const type =
        options_.poses == PoseKind::odometry ? "nav_msgs/Odometry" : "geometry_msgs/PoseStamped";
    Diagnosis out{Diagnosis::ok, "poses", fmt::format("{:.1f} Hz", rate_.hertz(now)), {}};
    if (rate_.count() == 0) {
      out.level = Diagnosis::error;
      out.message = fmt::format("no {} on {}", type, topic_);
    } else if (rate_.silence(now) > 1) {
      out.level = Diagnosis::error;
      out.message = fmt::format("no {} on {} for {:.1f} s", type, topic_, rate_.silence(now));
    } else if (samples_.empty()) {
      out.level = Diagnosis::error;
      out.message = fmt::format("{}: no pose is usable (not finite, or no unit quaternion)", topic_);
    }
    out.values = {{"topic", topic_},
                  {"received", fmt::format("{}", rate_.count())},
                  {"rate_hz", fmt::format("{:.1f}", rate_.hertz(now))},
                  {"unusable", fmt::format("{}", unusable_)},
                  {"out_of_order", fmt::format("{}", out_of_order_)},
                  {"jumps", fmt::format("{}", jumps_)},
                  {"last_jump", last_jump_},
                  {"world_frame", world_},
                  {"pose_of", child_.empty() ? options_.base_frame : child_}};
    return out;
  }

 private:
  struct Sample {
    Time time;
    Pose pose;
  };

  void jump(const std::string& why) {
    samples_.clear();
    ++jumps_;
    last_jump_ = why;
  }

  /// How far a place is from where the last poses lead to; 0 where a vehicle may be there.
  [[nodiscard]] double unexpected(Time time, const Eigen::Vector3d& place) const {
    constexpr double kUnsaid = 0.3;       // m
    constexpr double kAcceleration = 30;  // m/s²
    constexpr double kLeastSpan = 0.05;   // s, for a velocity
    if (samples_.size() < 2) return 0;
    const Sample& last = samples_.back();
    const double dt = seconds_between(last.time, time);
    if (!(dt > 0) || dt > kFarthestApart) return 0;
    const auto before = std::find_if(samples_.rbegin(), samples_.rend(), [&](const Sample& sample) {
      return seconds_between(sample.time, last.time) >= kLeastSpan;
    });
    if (before == samples_.rend()) return 0;
    const double span = seconds_between(before->time, last.time);
    if (span > 2 * kFarthestApart) return 0;
    const Eigen::Vector3d velocity = (last.pose.translation - before->pose.translation) / span;
    const double off = (place - last.pose.translation - dt * velocity).norm();
    return off > kUnsaid + kAcceleration * dt * (dt + span) / 2 ? off : 0;
  }

  /// False, with the reason in `reply`, if there is none.
  bool interpolate_at(Time time, Pose& pose, PoseReply& reply) const {
    using Kind = PoseReply::Kind;
    if (samples_.empty() || samples_.back().time < time) {
      reply.kind = Kind::not_yet;
      reply.why = rate_.count() == 0 ? "no pose has come" : "no pose in time";
      return false;
    }
    const auto after = std::lower_bound(samples_.begin(), samples_.end(), time,
                                        [](const Sample& sample, Time t) { return sample.time < t; });
    if (after->time == time) {
      pose = after->pose;
      return true;
    }
    if (after == samples_.begin()) {
      reply.kind = Kind::never;
      reply.why = "the image is older than the poses";
      return false;
    }
    const Sample& before = *std::prev(after);
    const double gap = seconds_between(before.time, after->time);
    if (gap > kFarthestApart) {
      reply.kind = Kind::never;
      reply.why = "a gap in the poses";
      return false;
    }
    pose = pade::interpolate(before.pose, after->pose, seconds_between(before.time, time) / gap);
    return true;
  }

  NodeOptions options_;
  std::string topic_;
  Mounting mounting_;
  std::mutex mutex_;
  std::deque<Sample> samples_;
  Rate rate_;
  std::string world_, child_, last_jump_;
  std::size_t unusable_ = 0, out_of_order_ = 0, jumps_ = 0;
};

/// tf.
class TransformPoses : public PoseInput {
 public:
  TransformPoses(const NodeOptions& options, Transforms& transforms)
      : options_(options), transforms_(transforms) {}

  PoseReply at(Time time, const std::string& camera) override {
    PoseReply reply;
    Placement placement;
    const auto answer = transforms_.find(world(), camera, time.nanoseconds, placement, reply.why);
    const std::lock_guard lock(mutex_);
    if (answer == Transforms::Answer::valid) {
      reply.kind = PoseReply::Kind::valid;
      reply.T_world_camera = reply.T_world_body = pose_of(placement);
      rate_.tick(steady_seconds());
    } else {
      reply.kind = answer == Transforms::Answer::never ? PoseReply::Kind::never : PoseReply::Kind::not_yet;
      missing_ = reply.why;
    }
    return reply;
  }
  void clear_after(Time /*now*/) override {}
  std::string world() override {
    return options_.world_frame.empty() ? "map" : frame_name(options_.world_frame);
  }
  Diagnosis diagnose(double now) override {
    const std::lock_guard lock(mutex_);
    Diagnosis out{Diagnosis::ok, "poses", "transforms", {}};
    if (rate_.silence(now) > 1) {
      out.level = Diagnosis::error;
      out.message = missing_.empty() ? "no transform was asked for yet: there is no usable image" : missing_;
    }
    out.values = {{"topic", "/tf"},
                  {"found", fmt::format("{}", rate_.count())},
                  {"last_missing", missing_},
                  {"world_frame", options_.world_frame.empty() ? "map" : options_.world_frame}};
    return out;
  }

 private:
  NodeOptions options_;
  Transforms& transforms_;
  std::mutex mutex_;
  Rate rate_;
  std::string missing_;
};

}  // namespace

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Rate::tick(double now) {
  constexpr double kWindow = 5;  // s
  ++count_;
  recent_.push_back(now);
  while (now - recent_.front() > kWindow) recent_.pop_front();
}

double Rate::hertz(double now) const {
  if (recent_.size() < 2 || silence(now) > 2) return 0;
  return static_cast<double>(recent_.size() - 1) / (recent_.back() - recent_.front());
}

double Rate::silence(double now) const {
  return recent_.empty() ? std::numeric_limits<double>::infinity() : now - recent_.back();
}

std::string frame_name(const std::string& name) { return name.starts_with('/') ? name.substr(1) : name; }

Mounting::Mounting(const NodeOptions& options, Transforms& transforms) : transforms_(transforms) {
  if (options.mounting.empty()) return;
  if (const auto pose = read_mounting(options.mounting)) stated_ = *pose;
}

std::optional<Pose> Mounting::of(const std::string& body, const std::string& camera, Time time,
                                 PoseReply& reply) {
  if (stated_) return stated_;
  if (body == camera) return Pose{};
  Placement placement;
  std::string why;
  const auto answer = transforms_.find(body, camera, time.nanoseconds, placement, why);
  if (answer == Transforms::Answer::valid) return pose_of(placement);
  reply.kind = answer == Transforms::Answer::never ? PoseReply::Kind::never : PoseReply::Kind::not_yet;
  reply.why = fmt::format("how the camera ({}) sits on {} is not known: {}", camera, body, why);
  return std::nullopt;
}

std::unique_ptr<PoseInput> make_pose_input(const NodeOptions& options, const Topics& topics,
                                           Transforms& transforms) {
  switch (options.poses) {
    case PoseKind::tf:
      return std::make_unique<TransformPoses>(options, transforms);
    case PoseKind::sensors:
      return make_sensor_poses(options, topics, transforms);
    case PoseKind::odometry:
    case PoseKind::pose:
      break;
  }
  return std::make_unique<TopicPoses>(options, topics.poses, transforms);
}

}  // namespace pade_ros
