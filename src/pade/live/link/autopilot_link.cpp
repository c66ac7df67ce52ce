#include "pade/live/link/autopilot_link.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <fmt/format.h>

#include "pade/live/link/autopilot_poses.hpp"
#include "pade/live/link/filtered_poses.hpp"
#include "pade/live/link/obstacle_points.hpp"
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
constexpr std::uint8_t kArmed = 128;                // MAV_MODE_FLAG_SAFETY_ARMED
constexpr double kOldest = 0.3;                     // age of a frame behind sectors, s
constexpr double kBetweenTexts = 1;                 // s

Time later(Time time, double seconds) {
  return {time.nanoseconds + static_cast<std::int64_t>(seconds * 1e9)};
}

}  // namespace

std::string text_of(const LinkReport& report) {
  if (report.missing != Missing::pose || report.poses_missing.empty())
    return std::string(text_of(report.missing));
  return fmt::format("no pose: {}", report.poses_missing);
}

AutopilotLink::AutopilotLink(std::unique_ptr<Port> port, const LinkOptions& options,
                             const navigation::NavigatorOptions& navigator)
    : port_(std::move(port)), options_(options) {
  if (options.poses == PoseMessages::sensors)
    poses_ = std::make_unique<FilteredPoses>(navigator);
  else
    poses_ = std::make_unique<AutopilotPoses>(options.poses);
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
  if (is_alone()) return send_health(now, progress);
  if (!report_.autopilot) return;
  ask(now);
  send_sectors(now);
  send_warning(now);
  send_health(now, progress);
  send_for_arming(now);
}

void AutopilotLink::take(const mavlink::Frame& frame, Time now) {
  if (const auto heartbeat = mavlink::unpack<mavlink::Heartbeat>(frame)) {
    if (heartbeat->autopilot == mavlink::kNoAutopilot || frame.component != mavlink::kAutopilotComponent)
      return;
    constexpr double kGone = 5;  // s
    const bool same = report_.autopilot && report_.autopilot->system == frame.system;
    if (!same && report_.autopilot && seconds_between(heard_, now) < kGone) return;  // of another vehicle
    if (!same && report_.autopilot) clock_ = LinkClock();
    if (!same)
      report_.autopilot = Autopilot{frame.system, frame.component, heartbeat->autopilot, heartbeat->type};
    heard_ = now;
    armed_ = (heartbeat->base_mode & kArmed) != 0;
    poses_->listen_to(*report_.autopilot);
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
  if (const auto gnss = mavlink::unpack<mavlink::GpsRawInt>(frame)) {
    report_.gnss = GnssState{gnss->fix_type, gnss->satellites_visible};
    gnss_heard_ = now;
  }
  poses_->add(frame);
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
  const std::vector<WantedMessage> wanted = poses_->wanted(options_.pose_rate);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto enough = static_cast<std::size_t>(0.7 * wanted[i].rate * kPatience);
    const bool come = i < asked_.size() && asked_[i].id == wanted[i].id &&
                      wanted[i].come - std::min(asked_[i].come, wanted[i].come) >= enough;
    if (!come) ask_for(wanted[i]);
  }
  asked_ = wanted;
  next_request_ = later(now, kPatience);
}

void AutopilotLink::ask_for(const WantedMessage& message) {
  mavlink::CommandLong command;
  command.target_system = report_.autopilot->system;
  command.target_component = report_.autopilot->component;
  command.command = kSetMessageInterval;
  command.param1 = static_cast<float>(message.id);
  command.param2 = static_cast<float>(1e6 / message.rate);  // µs
  send(command);
}

/// The sectors are those of the exposure, the receiver takes them for those of now. Whole bins: between them
/// the rule that no obstacle is lost would not hold.
void AutopilotLink::turn_to_newest_heading(mavlink::ObstacleDistance& sectors) const {
  const auto theirs = offered_pose_time();
  if (!theirs || sectors.increment == 0) return;
  constexpr double kDegrees = 180 / std::numbers::pi;
  const auto bins =
      static_cast<std::ptrdiff_t>(std::lround(kDegrees * poses_->turned_since(*theirs) / sectors.increment));
  const auto count = static_cast<std::ptrdiff_t>(sectors.distances.size());
  std::rotate(sectors.distances.begin(), sectors.distances.begin() + ((bins % count) + count) % count,
              sectors.distances.end());
}

bool AutopilotLink::in_faces() const {
  return options_.obstacles == ObstacleMessages::faces && report_.autopilot &&
         report_.autopilot->kind == ardupilot_kind;
}

std::optional<Time> AutopilotLink::time_of_poses(Time ours) const {
  return poses_->in_our_time() ? ours : clock_.to_autopilot(ours);
}

/// By our clock; empty: there is none.
std::optional<Time> AutopilotLink::newest_pose() const {
  const Time newest = poses_->newest();
  if (newest.nanoseconds == 0) return std::nullopt;
  if (!poses_->in_our_time()) return clock_.to_ours(newest);
  return Time{newest.nanoseconds + static_cast<std::int64_t>(1e9 * poses_->behind())};
}

std::optional<Time> AutopilotLink::offered_pose_time() const {
  return time_of_poses(later(offered_frame_, offered_ ? offered_->time_offset : 0));
}

bool AutopilotLink::send_level() {
  turn_to_newest_heading(*offered_->level);
  return send(*offered_->level);
}

/// As seen from where the vehicle is by now.
bool AutopilotLink::send_points() {
  const auto theirs = offered_pose_time();
  if (!theirs) return false;
  std::vector<Eigen::Vector3d>& points = *offered_->points;
  const PoseAnswer then = poses_->at(*theirs);
  const PoseAnswer now = poses_->at(poses_->newest());
  if (then.kind == PoseAnswer::Kind::valid && now.kind == PoseAnswer::Kind::valid &&
      then.jumps == now.jumps) {
    const Pose T_now_then = now.T_world_body.inverse() * then.T_world_body;
    for (Eigen::Vector3d& point : points) point = T_now_then * point;
  }
  // Each frame has two stamps of its own.
  auto stamp = static_cast<std::uint32_t>(theirs->nanoseconds / 1'000'000);
  if (stamp - last_stamp_ < 2 || last_stamp_ - stamp < 2) stamp = last_stamp_ + 2;
  last_stamp_ = stamp;
  bool sent = true;
  for (const auto& message : obstacle_messages(points, stamp, offered_->options))
    sent = send(message) && sent;
  return sent;
}

void AutopilotLink::send_sectors(Time now) {
  if (!offered_) return;
  report_.level_instead = options_.obstacles == ObstacleMessages::faces && !in_faces();
  if (seconds_between(offered_frame_, now) > kOldest) {
    ++report_.sectors_stale;
  } else if (in_faces() && offered_->points ? send_points() : offered_->level && send_level()) {
    ++report_.sectors_sent;
    progress_.sent = offered_frame_.nanoseconds;
    obstacles_sent_ = now;
  }
  offered_.reset();
}

void AutopilotLink::send_for_arming(Time now) {
  constexpr double kHeartbeat = 1.5, kPause = 0.2;  // s; ArduPilot waits for 0.5 s
  const Missing missing = report_.missing;
  const bool all_but_depth =
      missing == Missing::nothing || missing == Missing::depth || missing == Missing::view;
  if (report_.autopilot->kind != ardupilot_kind || armed_ || seconds_between(heard_, now) > kHeartbeat ||
      !all_but_depth || seconds_between(obstacles_sent_, now) < kPause)
    return;
  mavlink::ObstacleDistance nothing = obstacle_distance_message({}, now, {});
  nothing.distances.fill(kUnknownDistance);
  if (!send(nothing)) return;
  ++report_.sectors_empty;
  obstacles_sent_ = now;
}

void AutopilotLink::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (warned_.insert(text).second) warnings_.push_back(text);
}

void AutopilotLink::send_warning(Time now) {
  if (warnings_.empty() || now < next_text_) return;
  say(kWarning, warnings_.front());
  warnings_.pop_front();
  next_text_ = later(now, kBetweenTexts);
}

/// A heartbeat each second, and at once where something has changed, but not more often than a line and a
/// pilot can take.
void AutopilotLink::send_health(Time now, const Progress& progress) {
  constexpr double kBetweenHeartbeats = 0.1;  // s
  progress_.synchronised = poses_->in_our_time() || clock_.synchronised(now);
  progress_.pose = newest_pose().value_or(Time{}).nanoseconds;
  const Missing missing = missing_now(now, progress, progress_);
  const bool changed = missing != report_.missing;
  report_.missing = missing;
  report_.poses_missing = missing == Missing::pose ? poses_->missing() : std::string();
  if (is_alone()) return;
  if (const std::string text = text_of(report_); said_ != text && now >= next_text_) {
    say(missing == Missing::nothing ? kInformation : kWarning, text);
    said_ = text;
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
  const auto theirs = time_of_poses(time);
  return theirs ? poses_->at(*theirs) : PoseAnswer{};
}

std::optional<Matrix6d> AutopilotLink::motion_covariance(Time t1, Time t2, const Pose& T_body_camera) const {
  const std::lock_guard lock(mutex_);
  const auto theirs1 = time_of_poses(t1);
  const auto theirs2 = time_of_poses(t2);
  if (!theirs1 || !theirs2) return std::nullopt;
  return poses_->motion_covariance(*theirs1, *theirs2, T_body_camera);
}

void AutopilotLink::offer(const FrameObstacles& obstacles, Time frame) {
  const std::lock_guard lock(mutex_);
  const bool says_anything = obstacles.level || (in_faces() && obstacles.points);
  offered_.reset();
  if (is_alone()) return;  // nobody wants them, so none is missing
  if (says_anything) offered_ = obstacles;
  offered_frame_ = frame;
  (says_anything ? progress_.offered : progress_.empty) = frame.nanoseconds;
}

void AutopilotLink::refresh_report(Time now) {
  report_.synchronised = clock_.synchronised(now);
  report_.clock_bound = clock_.bound();
  report_.clock_restarts = clock_.restarts();
  report_.poses = poses_->count();
  report_.jumps = poses_->jumps();
  report_.poses_come = poses_->newest().nanoseconds != 0;
  constexpr double kGnssGone = 3;  // s
  if (seconds_between(gnss_heard_, now) > kGnssGone) report_.gnss.reset();
}

LinkReport AutopilotLink::report() const {
  const std::lock_guard lock(mutex_);
  LinkReport report = report_;
  report.poses_missing = poses_->missing();
  report.poses_summary = poses_->summary();
  return report;
}

}  // namespace pade::live
