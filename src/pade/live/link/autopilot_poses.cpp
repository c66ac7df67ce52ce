#include "pade/live/link/autopilot_poses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "pade/core/sensors/pose_jumps.hpp"
#include "pade/live/link/bracket.hpp"
#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"

namespace pade::live {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using mavlink::unpack;

constexpr double kKept = 3;  // s

Time since_start(std::uint32_t ms) { return {static_cast<std::int64_t>(ms) * 1'000'000}; }

Quaterniond quaternion(float w, float x, float y, float z) {
  return {static_cast<double>(w), static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

Vector3d vector(float x, float y, float z) { return Eigen::Vector3f(x, y, z).cast<double>(); }

/// Yaw, then pitch, then roll.
Quaterniond from_angles(double roll, double pitch, double yaw) {
  return Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Vector3d::UnitX());
}

}  // namespace

template <class Samples, class Value>
bool AutopilotPoses::push(Samples& samples, Time time, const Value& value) {
  if (!samples.empty() && seconds_between(time, samples.back().time) > 1) jump();  // its clock went back
  if (!samples.empty() && time <= samples.back().time) return false;
  samples.push_back({time, value});
  while (seconds_between(samples.front().time, time) > kKept) samples.pop_front();
  return true;
}

void AutopilotPoses::listen_to(const Autopilot& autopilot) {
  const bool same =
      autopilot_ && autopilot_->system == autopilot.system && autopilot_->component == autopilot.component;
  if (same) return;
  if (autopilot_) jump();
  autopilot_ = autopilot;
  quaternions_ = false;
  reset_counter_ = -1;
}

void AutopilotPoses::jump() {
  attitudes_.clear();
  positions_.clear();
  ++jumps_;
}

/// @param rate  how fast it says that it turns, rad/s; NaN: not known
void AutopilotPoses::add_attitude(Time time, const Quaterniond& q_ned_frd, double rate) {
  // North is y of ENU; forward-right-down and forward-left-up differ by half a turn about x.
  static const Quaterniond R_enu_ned((Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished());
  static const Quaterniond R_frd_flu(0, 1, 0, 0);
  if (!(std::abs(q_ned_frd.norm() - 1) < 0.01)) return;
  const Quaterniond turn = (R_enu_ned * q_ned_frd * R_frd_flu).normalized();
  if (!attitudes_.empty()) {
    // A heading that is set anew: no vehicle turns by that much and says that it does not.
    constexpr double kUnsaid = 0.15;      // rad
    constexpr double kUnseenTurning = 3;  // rad/s^2
    const double dt = seconds_between(attitudes_.back().time, time);
    const double most = explained(dt, {kUnsaid, std::max(rate_, rate), kUnseenTurning});
    const bool known = std::isfinite(rate_) && std::isfinite(rate);
    if (known && dt > 0 && attitudes_.back().value.angularDistance(turn) > most) jump();
  }
  if (!push(attitudes_, time, turn)) return;
  rate_ = rate;
  ++attitudes_come_;
}

void AutopilotPoses::add_position(Time time, const Vector3d& ned, const Vector3d& velocity_ned) {
  if (!ned.allFinite()) return;
  const Vector3d place(ned.y(), ned.x(), -ned.z());
  const Vector3d velocity(velocity_ned.y(), velocity_ned.x(), -velocity_ned.z());
  if (!positions_.empty()) {
    constexpr double kUnsaid = 0.3;        // m
    constexpr double kUnsaidSpeed = 0.5;   // m/s
    constexpr double kUnseenSpeeding = 3;  // m/s^2
    const double dt = seconds_between(positions_.back().time, time);
    const Vector3d expected = positions_.back().value + dt / 2 * (velocity_ + velocity);
    const double most = explained(dt, {kUnsaid, kUnsaidSpeed, kUnseenSpeeding});
    if (dt > 0 && expected.allFinite() && (place - expected).norm() > most) jump();
  }
  if (!push(positions_, time, place)) return;
  velocity_ = velocity;
  ++positions_come_;
}

void AutopilotPoses::add_odometry(const mavlink::Frame& frame) {
  constexpr std::uint8_t kLocalNed = 1;
  const auto m = unpack<mavlink::Odometry>(frame);
  constexpr std::int8_t kFailed = -1;  // quality
  if (!m || m->frame_id != kLocalNed || m->quality == kFailed) return;
  if (reset_counter_ >= 0 && reset_counter_ != m->reset_counter) jump();
  reset_counter_ = m->reset_counter;
  const Time time{static_cast<std::int64_t>(m->time_usec % 4'600'000'000'000'000) * 1000};
  // It counts its resets itself, and its velocity is in a frame of the body.
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  add_attitude(time, quaternion(m->q[0], m->q[1], m->q[2], m->q[3]), kNotKnown);
  add_position(time, vector(m->x, m->y, m->z), Vector3d::Constant(kNotKnown));
}

void AutopilotPoses::add(const mavlink::Frame& frame) {
  if (messages_ == PoseMessages::odometry) {
    if (frame.id == mavlink::Odometry::kId) add_odometry(frame);
    return;
  }
  if (const auto m = unpack<mavlink::AttitudeQuaternion>(frame)) {
    quaternions_ = true;
    add_attitude(since_start(m->time_boot_ms), quaternion(m->q1, m->q2, m->q3, m->q4),
                 vector(m->rollspeed, m->pitchspeed, m->yawspeed).norm());
  } else if (const auto a = unpack<mavlink::Attitude>(frame); a && !quaternions_) {
    const Vector3d angles = vector(a->roll, a->pitch, a->yaw);
    // Rates of the body about its own axes, as those of the quaternion.
    add_attitude(since_start(a->time_boot_ms), from_angles(angles.x(), angles.y(), angles.z()),
                 vector(a->rollspeed, a->pitchspeed, a->yawspeed).norm());
  } else if (const auto p = unpack<mavlink::LocalPositionNed>(frame)) {
    add_position(since_start(p->time_boot_ms), vector(p->x, p->y, p->z), vector(p->vx, p->vy, p->vz));
  }
}

PoseAnswer AutopilotPoses::at(Time time) {
  const Bracket turn = bracket(attitudes_, time);
  const Bracket place = bracket(positions_, time);
  using Kind = PoseAnswer::Kind;
  if (turn.kind == Kind::never) return {Kind::never, {}, turn.why, jumps_};
  if (place.kind == Kind::never) return {Kind::never, {}, place.why, jumps_};
  if (turn.kind == Kind::not_yet || place.kind == Kind::not_yet) return {Kind::not_yet, {}, {}, jumps_};
  PoseAnswer answer{Kind::valid, {}, {}, jumps_};
  const auto& q = attitudes_[turn.after].value;
  const auto& p = positions_[place.after].value;
  answer.T_world_body.rotation =
      turn.share < 1 ? attitudes_[turn.after - 1].value.slerp(turn.share, q).normalized() : q;
  answer.T_world_body.translation =
      place.share < 1 ? Vector3d((1 - place.share) * positions_[place.after - 1].value + place.share * p) : p;
  return answer;
}

double AutopilotPoses::turned_since(Time time) {
  const Bracket then = bracket(attitudes_, time);
  if (then.kind != PoseAnswer::Kind::valid) return 0;
  const auto heading = [](const Quaterniond& rotation) {
    const Vector3d ahead = rotation * Vector3d::UnitX();
    return std::atan2(ahead.y(), ahead.x());
  };
  return std::remainder(heading(attitudes_[then.after].value) - heading(attitudes_.back().value),
                        2 * std::numbers::pi);
}

Time AutopilotPoses::newest() {
  if (attitudes_.empty() || positions_.empty()) return {};
  return std::min(attitudes_.back().time, positions_.back().time);
}

std::vector<WantedMessage> AutopilotPoses::wanted(double pose_rate) const {
  if (messages_ == PoseMessages::odometry)
    return {{mavlink::Odometry::kId, pose_rate, std::min(attitudes_come_, positions_come_)}};
  return {{mavlink::AttitudeQuaternion::kId, pose_rate, attitudes_come_},
          {mavlink::LocalPositionNed::kId, pose_rate, positions_come_}};
}

std::string AutopilotPoses::missing() {
  if (messages_ == PoseMessages::odometry)
    return newest().nanoseconds != 0 ? std::string() : std::string("no ODOMETRY in LOCAL_NED");
  constexpr double kStopped = 0.3;  // s; less than what is called stale
  // After a jump either has to come anew, which takes the one a moment longer than the other.
  const auto alone = [](const auto& samples, std::size_t others) {
    return others == 0 || samples.empty() ||
           seconds_between(samples.front().time, samples.back().time) > kStopped;
  };
  if (attitudes_.empty()) return alone(positions_, attitudes_come_) ? "no ATTITUDE" : "";
  if (positions_.empty()) return alone(attitudes_, positions_come_) ? "no LOCAL_POSITION_NED" : "";
  // Both have come; where one has stopped and the other goes on, it is no cable.
  const double ahead = seconds_between(positions_.back().time, attitudes_.back().time);
  if (ahead > kStopped) return "no LOCAL_POSITION_NED";
  if (ahead < -kStopped) return "no ATTITUDE";
  return {};
}

std::string AutopilotPoses::summary() {
  return fmt::format("{} attitudes, {} positions", attitudes_come_, positions_come_);
}

}  // namespace pade::live
