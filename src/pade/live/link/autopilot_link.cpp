#include "pade/live/link/autopilot_link.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <fmt/format.h>

#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {
namespace {

constexpr std::uint8_t kOnboardController = 18;  // MAV_TYPE_ONBOARD_CONTROLLER
constexpr std::uint8_t kActive = 4;              // MAV_STATE_ACTIVE
constexpr std::uint8_t kStandby = 3;             // MAV_STATE_STANDBY
constexpr std::uint8_t kVersion = 3;             // of MAVLink, as all heartbeats say
constexpr std::uint8_t kWarning = 4;             // MAV_SEVERITY
constexpr std::uint8_t kInformation = 6;
constexpr std::uint16_t kSetMessageInterval = 511;  // MAV_CMD_SET_MESSAGE_INTERVAL
constexpr double kOldest = 0.3;                     // age of a frame behind sectors, s

Time later(Time time, double seconds) {
  return {time.nanoseconds + static_cast<std::int64_t>(seconds * 1e9)};
}

}  // namespace

std::string text_of(const LinkReport& report, PoseMessages poses) {
  std::string text(text_of(report.missing));
  if (report.missing != Missing::pose || report.poses_come) return text;
  if (poses == PoseMessages::odometry) return "no pose: no ODOMETRY in LOCAL_NED";
  return report.attitudes == 0 ? "no pose: no ATTITUDE" : "no pose: no LOCAL_POSITION_NED";
}

template <class Message>
bool AutopilotLink::send(const Message& message) {
  const mavlink::Packet packet = pack(message, sender_);
  if (port_->write(packet.span())) return true;
  ++report_.unsent;
  return false;
}

void AutopilotLink::say(std::uint8_t severity, std::string_view text) {
  mavlink::StatusText message;
  message.severity = severity;
  const std::string line = fmt::format("PADE: {}", text);
  std::copy_n(line.begin(), std::min(line.size(), message.text.size()), message.text.begin());
  send(message);
}

void AutopilotLink::step(Time now, const Progress& progress) {
  std::array<std::uint8_t, 2048> bytes{};
  const std::lock_guard lock(mutex_);
  constexpr int kMostReads = 64;  // so that a flood of bytes does not keep anything from being sent
  for (int i = 0; i < kMostReads; ++i) {
    const std::size_t count = port_->read(bytes);
    if (count == 0) break;
    parser_.add(std::span(bytes).first(count), [&](const mavlink::Frame& frame) { take(frame, now); });
  }
  report_.in = parser_.counts();
  refresh_report(now);
  if (!report_.autopilot) return;
  ask(now);
  send_sectors(now);
  send_health(now, progress);
}

void AutopilotLink::take(const mavlink::Frame& frame, Time now) {
  if (const auto heartbeat = mavlink::unpack<mavlink::Heartbeat>(frame)) {
    if (heartbeat->autopilot == mavlink::kNoAutopilot || frame.component != mavlink::kAutopilotComponent)
      return;
    constexpr double kGone = 5;  // s
    const bool same = report_.autopilot && report_.autopilot->system == frame.system;
    if (!same && report_.autopilot && seconds_between(heard_, now) < kGone) return;  // of another vehicle
    if (!same)
      report_.autopilot = Autopilot{frame.system, frame.component, heartbeat->autopilot, heartbeat->type};
    heard_ = now;
    port_->answer_sender();
    sender_.system = frame.system;  // PX4 drops what another system sends
    return;
  }
  const auto& autopilot = report_.autopilot;
  if (!autopilot || frame.system != autopilot->system || frame.component != autopilot->component) return;
  port_->answer_sender();
  if (frame.id == mavlink::Timesync::kId) return take_timesync(frame, now);
  if (const auto ack = mavlink::unpack<mavlink::CommandAck>(frame)) {
    constexpr std::uint8_t kInProgress = 5;
    const bool ours = ack->command == kSetMessageInterval &&
                      (ack->target_system == 0 || ack->target_system == sender_.system);
    if (ours && ack->result == 0) report_.refused.clear();
    if (ours && ack->result != 0 && ack->result != kInProgress)
      report_.refused = fmt::format("command {} (result {})", ack->command, ack->result);
  }
  if (const auto gnss = mavlink::unpack<mavlink::GpsRawInt>(frame))
    report_.gnss = GnssState{gnss->fix_type, gnss->satellites_visible};
  poses_.add(frame);
}

void AutopilotLink::take_timesync(const mavlink::Frame& frame, Time now) {
  const auto m = mavlink::unpack<mavlink::Timesync>(frame);
  if (m->tc1 == 0) {
    send(mavlink::Timesync{now.nanoseconds, m->ts1, frame.system, frame.component});
    return;
  }
  constexpr std::int64_t kLongest = 1'000'000'000;  // ns; older ones are not answers to questions of ours
  const bool ours = m->ts1 > 0 && m->ts1 <= now.nanoseconds && now.nanoseconds - m->ts1 < kLongest;
  if (ours && m->tc1 > 0) clock_.add({m->ts1}, {m->tc1}, now);
}

/// For its clock, and for poses at the rate that is wanted.
void AutopilotLink::ask(Time now) {
  if (now >= next_question_) {
    send(mavlink::Timesync{0, now.nanoseconds, report_.autopilot->system, report_.autopilot->component});
    next_question_ = later(now, clock_.synchronised(now) ? 0.1 : 0.05);
  }
  if (now < next_request_) return;
  constexpr double kPatience = 2;  // s
  const auto enough = static_cast<std::size_t>(0.7 * options_.pose_rate * kPatience);
  const bool come = next_request_.nanoseconds != 0 && poses_.attitudes() - attitudes_asked_at_ >= enough &&
                    poses_.positions() - positions_asked_at_ >= enough;
  next_request_ = later(now, kPatience);
  attitudes_asked_at_ = poses_.attitudes();
  positions_asked_at_ = poses_.positions();
  if (come) return;
  const bool odometry = options_.poses == PoseMessages::odometry;
  const std::vector<std::uint32_t> messages =
      odometry ? std::vector{mavlink::Odometry::kId}
               : std::vector{mavlink::AttitudeQuaternion::kId, mavlink::LocalPositionNed::kId};
  for (const std::uint32_t id : messages) {
    mavlink::CommandLong command;
    command.target_system = report_.autopilot->system;
    command.target_component = report_.autopilot->component;
    command.command = kSetMessageInterval;
    command.param1 = static_cast<float>(id);
    command.param2 = static_cast<float>(1e6 / options_.pose_rate);  // µs
    send(command);
  }
}

/// The sectors are those of the exposure, the receiver takes them for those of now. Whole bins: between them
/// the rule that no obstacle is lost would not hold.
void AutopilotLink::turn_to_newest_heading(mavlink::ObstacleDistance& sectors, Time frame) const {
  const auto theirs = clock_.to_autopilot(frame);
  if (!theirs || sectors.increment == 0) return;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const auto bins =
      static_cast<std::ptrdiff_t>(std::lround(kDegrees * poses_.turned_since(*theirs) / sectors.increment));
  const auto count = static_cast<std::ptrdiff_t>(sectors.distances.size());
  std::rotate(sectors.distances.begin(), sectors.distances.begin() + ((bins % count) + count) % count,
              sectors.distances.end());
}

void AutopilotLink::send_sectors(Time now) {
  if (!offered_) return;
  if (seconds_between(offered_frame_, now) > kOldest) {
    ++report_.sectors_stale;
  } else if (turn_to_newest_heading(*offered_, offered_frame_); send(*offered_)) {
    ++report_.sectors_sent;
    progress_.sent = offered_frame_.nanoseconds;
  }
  offered_.reset();
}

/// A heartbeat each second, and at once where something has changed, but not more often than a line and a
/// pilot can take.
void AutopilotLink::send_health(Time now, const Progress& progress) {
  constexpr double kBetweenHeartbeats = 0.1, kBetweenTexts = 1;  // s
  const auto newest = clock_.to_ours(poses_.newest());
  const bool any = poses_.newest().nanoseconds != 0 && newest.has_value();
  progress_.synchronised = clock_.synchronised(now);
  progress_.pose = any ? newest->nanoseconds : 0;
  const Missing missing = missing_now(now, progress, progress_);
  const bool changed = missing != report_.missing;
  report_.missing = missing;
  if (said_ != missing && now >= next_text_) {
    say(missing == Missing::nothing ? kInformation : kWarning, text_of(report_, options_.poses));
    said_ = missing;
    next_text_ = later(now, kBetweenTexts);
  }
  if (changed) next_heartbeat_ = earliest_heartbeat_;
  if (now < next_heartbeat_) return;
  send_heartbeat(missing == Missing::nothing ? kActive : kStandby);
  next_heartbeat_ = later(now, 1);
  earliest_heartbeat_ = later(now, kBetweenHeartbeats);
}

void AutopilotLink::send_heartbeat(std::uint8_t state) {
  mavlink::Heartbeat heartbeat;
  heartbeat.type = kOnboardController;
  heartbeat.autopilot = mavlink::kNoAutopilot;
  heartbeat.system_status = state;
  heartbeat.mavlink_version = kVersion;
  send(heartbeat);
}

void AutopilotLink::end() {
  const std::lock_guard lock(mutex_);
  if (!report_.autopilot) return;
  say(kWarning, "obstacle mapping has ended");
  send_heartbeat(kStandby);
}

PoseAnswer AutopilotLink::pose_at(Time time) const {
  const std::lock_guard lock(mutex_);
  const auto theirs = clock_.to_autopilot(time);
  return theirs ? poses_.at(*theirs) : PoseAnswer{};
}

void AutopilotLink::offer(const std::optional<mavlink::ObstacleDistance>& sectors, Time frame) {
  const std::lock_guard lock(mutex_);
  offered_ = sectors;
  offered_frame_ = frame;
  (sectors ? progress_.offered : progress_.empty) = frame.nanoseconds;
}

void AutopilotLink::refresh_report(Time now) {
  report_.synchronised = clock_.synchronised(now);
  report_.clock_bound = clock_.bound();
  report_.clock_restarts = clock_.restarts();
  report_.attitudes = poses_.attitudes();
  report_.positions = poses_.positions();
  report_.jumps = poses_.jumps();
  report_.poses_come = poses_.newest().nanoseconds != 0;
}

LinkReport AutopilotLink::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

}  // namespace pade::live
