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

constexpr double kKept = 10;  // s

constexpr const char* kNamelessWorld = "map";

struct Sample {
  Time time;
  Pose pose;
};

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
    } else if (const auto found = pade::jump_to(samples_, time, pose)) {
      jump(jump_text(*found, "the poses"));
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
    if (!options_.world_frame.empty()) return frame_name(options_.world_frame);
    return world_.empty() ? kNamelessWorld : world_;  // that of messages which name none
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
                  {"world_frame", world_.empty() && rate_.count() > 0 ? "(the messages name none)" : world_},
                  {"pose_of", child_.empty() ? options_.base_frame : child_}};
    return out;
  }

 private:
  void jump(const std::string& why) {
    samples_.clear();
    ++jumps_;
    last_jump_ = why;
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
    if (gap > pade::kFarthestPosesApart) {
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
      follow({time, pose_of(placement)}, camera);
      reply.kind = PoseReply::Kind::valid;
      reply.T_world_camera = reply.T_world_body = pose_of(placement);
      rate_.tick(steady_seconds());
    } else {
      reply.kind = answer == Transforms::Answer::never ? PoseReply::Kind::never : PoseReply::Kind::not_yet;
      missing_ = reply.why;
    }
    reply.jumps = jumps_;
    reply.last_jump = last_jump_;
    if (reply.kind == PoseReply::Kind::valid && begun_ && time < *begun_) {
      reply.kind = PoseReply::Kind::never;
      reply.why = "the image is of before a jump of the transforms";
    }
    return reply;
  }
  void clear_after(Time /*now*/) override {
    const std::lock_guard lock(mutex_);
    answered_.clear();
    begun_.reset();
  }
  std::string world() override {
    return options_.world_frame.empty() ? kNamelessWorld : frame_name(options_.world_frame);
  }
  Diagnosis diagnose(double now) override {
    const std::lock_guard lock(mutex_);
    Diagnosis out{Diagnosis::ok, "poses", "transforms", {}};
    if (rate_.silence(now) > 1) {
      out.level = Diagnosis::error;
      out.message = missing_.empty() ? "no transform was asked for yet: there is no usable image" : missing_;
    }
    out.values = {{"topic", "/tf"},           {"found", fmt::format("{}", rate_.count())},
                  {"last_missing", missing_}, {"jumps", fmt::format("{}", jumps_)},
                  {"last_jump", last_jump_},  {"world_frame", world()}};
    return out;
  }

 private:
  /// Whether the transforms lead on to a pose. Between images that are far apart they are asked as well:
  /// it is not they that paused. The mutex is held.
  void follow(const Sample& next, const std::string& camera) {
    if (!answered_.empty() && next.time <= answered_.back().time) return;
    const double gap = answered_.empty() ? 0 : seconds_between(answered_.back().time, next.time);
    if (gap > pade::kFarthestPosesApart && gap < kKept) {
      constexpr double kStep = 0.1;  // s
      const Stamp begin = answered_.back().time.nanoseconds;
      const int steps = static_cast<int>(std::ceil(gap / kStep));
      for (int i = 1; i < steps; ++i) {
        const Stamp stamp = begin + (next.time.nanoseconds - begin) / steps * i;
        Placement placement;
        std::string why;
        if (transforms_.find(world(), camera, stamp, placement, why) == Transforms::Answer::valid)
          take({{stamp}, pose_of(placement)});
      }
    }
    take(next);
  }
  void take(const Sample& next) {
    if (const auto found = pade::jump_to(answered_, next.time, next.pose)) {
      answered_.clear();
      begun_ = next.time;
      ++jumps_;
      last_jump_ = jump_text(*found, "the transforms");
    }
    answered_.push_back(next);
    constexpr double kNeeded = 1;  // s, for a velocity
    while (seconds_between(answered_.front().time, next.time) > kNeeded) answered_.pop_front();
  }

  NodeOptions options_;
  Transforms& transforms_;
  std::mutex mutex_;
  Rate rate_;
  std::string missing_, last_jump_;
  std::deque<Sample> answered_;
  std::optional<Time> begun_;  // the newest world
  std::size_t jumps_ = 0;
};

}  // namespace

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string jump_text(const pade::PoseJump& jump, const std::string& what) {
  constexpr double kDegrees = 57.29577951308232;
  switch (jump.kind) {
    case pade::PoseJump::Kind::place:
      return fmt::format("{} jumped by {:.2f} m", what, jump.size);
    case pade::PoseJump::Kind::turn:
      return fmt::format("{} turned by {:.0f} degrees at once", what, kDegrees * jump.size);
    case pade::PoseJump::Kind::gap:
      break;
  }
  return fmt::format("{} were silent for {:.1f} s", what, jump.size);
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
