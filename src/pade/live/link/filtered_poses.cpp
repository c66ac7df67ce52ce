#include "pade/live/link/filtered_poses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {
namespace {

using navigation::Answer;
using navigation::NavigationStatus;

double heading_of(const Pose& T_world_body) {
  const Eigen::Vector3d forward = T_world_body.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

}  // namespace

void FilteredPoses::listen_to(const Autopilot& autopilot) {
  const bool same = autopilot_ && autopilot_->system == autopilot.system &&
                    autopilot_->component == autopilot.component && autopilot_->kind == autopilot.kind;
  if (same) return;
  const bool first = !autopilot_;
  autopilot_ = autopilot;
  if (first)
    sensors_.emplace(autopilot, BootClock());
  else
    begin_anew();
}

void FilteredPoses::begin_anew() {
  navigator_ = navigation::Navigator(options_);
  sensors_.emplace(*autopilot_, BootClock());
  origin_.reset();
  recent_.clear();
  restarts_ = 0;
  ++jumps_;
}

void FilteredPoses::add(const mavlink::Frame& frame) {
  if (!sensors_) return;
  sensors_->add(frame);
  NewSamples samples = sensors_->take();
  constexpr double kClockWentBack = 1;  // s
  if (!samples.imu.empty() && !recent_.empty() &&
      seconds_between(samples.imu.front().time, recent_.back()) > kClockWentBack) {
    begin_anew();
    sensors_->add(frame);
    samples = sensors_->take();
  }
  for (const ImuSample& sample : samples.imu) {
    constexpr double kRecent = 2;  // s
    navigator_.add(sample);
    ++imu_samples_;
    recent_.push_back(sample.time);
    const auto old = std::find_if(recent_.begin(), recent_.end(),
                                  [&](Time time) { return seconds_between(time, sample.time) <= kRecent; });
    recent_.erase(recent_.begin(), old);
  }
  for (const MagneticField& field : samples.fields) navigator_.add(field);
  for (const BarometricHeight& height : samples.heights) navigator_.add(height);
  heights_ += samples.heights.size();
  if (!samples.fixes.empty()) add_fixes(std::move(samples.fixes));
  if (const std::uint64_t restarts = navigator_.health().restarts; restarts != restarts_) {
    restarts_ = restarts;
    ++jumps_;
  }
}

/// East, north, up of the first that ever came.
void FilteredPoses::add_fixes(std::vector<io::GeodeticFix> fixes) {
  const bool first = !origin_;
  if (first) origin_ = fixes.front();
  fixes_ += fixes.size();
  fixes.insert(fixes.begin(), *origin_);
  std::vector<std::string> remarks;
  const GnssLog log = io::local_log(fixes, "GPS_RAW_INT", remarks);
  if (first) remarks_ = std::move(remarks);
  for (std::size_t i = 1; i < log.fixes.size(); ++i) navigator_.add(log.fixes[i]);
  const std::size_t of_the_origin = origin_->velocity ? 1 : 0;
  for (std::size_t i = of_the_origin; i < log.velocities.size(); ++i) navigator_.add(log.velocities[i]);
}

PoseAnswer FilteredPoses::at(Time time) {
  PoseAnswer answer;
  answer.jumps = jumps_;
  const navigation::AbsolutePose pose = navigator_.absolute_pose(time);
  if (navigator_.health().status == NavigationStatus::lost) {
    answer.kind = PoseAnswer::Kind::never;
    answer.why = "the filter is lost";
    return answer;
  }
  switch (pose.answer) {
    case Answer::valid:
      answer.kind = PoseAnswer::Kind::valid;
      answer.T_world_body = pose.T_smooth_body;
      break;
    case Answer::too_new:
      answer.kind = PoseAnswer::Kind::not_yet;
      break;
    case Answer::not_initialised:
      answer.kind = PoseAnswer::Kind::never;
      answer.why = "the filter had not started";
      break;
    case Answer::too_old:
      answer.kind = PoseAnswer::Kind::never;
      answer.why = "the filter remembers nothing of that time";
      break;
  }
  return answer;
}

std::optional<Matrix6d> FilteredPoses::motion_covariance(Time t1, Time t2, const Pose& T_body_camera) {
  const navigation::RelativePose motion = navigator_.relative_pose(t1, t2, T_body_camera);
  if (motion.answer != Answer::valid) return std::nullopt;
  return motion.motion.covariance;
}

Time FilteredPoses::newest() {
  if (navigator_.health().status == NavigationStatus::lost) return {};
  const Time newest = navigator_.newest();
  return navigator_.absolute_pose(newest).answer == Answer::valid ? newest : Time{};
}

double FilteredPoses::turned_since(Time time) {
  const navigation::AbsolutePose then = navigator_.absolute_pose(time);
  const navigation::AbsolutePose now = navigator_.absolute_pose(navigator_.newest());
  if (then.answer != Answer::valid || now.answer != Answer::valid) return 0;
  return std::remainder(heading_of(then.T_smooth_body) - heading_of(now.T_smooth_body), 2 * std::numbers::pi);
}

double FilteredPoses::imu_rate() const {
  if (recent_.size() < 2) return 0;
  const double span = seconds_between(recent_.front(), recent_.back());
  return span > 0 ? static_cast<double>(recent_.size() - 1) / span : 0;
}

std::string FilteredPoses::missing() {
  if (imu_samples_ == 0)
    return sensors_ && sensors_->unitless() > 0 ? "RAW_IMU has no units" : "no IMU message";
  if (const double rate = imu_rate(); rate > 0 && rate < slowest_imu) return "the IMU is slower than 20 Hz";
  if (fixes_ == 0) return "no GNSS fix";
  const NavigationStatus status = navigator_.health().status;
  if (status == NavigationStatus::lost) return "the filter is lost";
  if (newest().nanoseconds != 0) return {};
  return status == NavigationStatus::uninitialised ? "the filter is starting" : std::string(heading_unknown);
}

std::vector<WantedMessage> FilteredPoses::wanted(double /*pose_rate*/) const {
  constexpr double kImuRate = 100;  // Hz
  constexpr double kSlowRate = 5;
  const WantedMessage fixes{mavlink::GpsRawInt::kId, kSlowRate, fixes_};
  // ArduPilot has no HIGHRES_IMU that every version sends; others leave RAW_IMU without a unit.
  if (autopilot_ && autopilot_->kind == ardupilot_kind)
    return {{mavlink::RawImu::kId, kImuRate, imu_samples_},
            {mavlink::ScaledPressure::kId, kSlowRate, heights_},
            fixes};
  return {{mavlink::HighresImu::kId, kImuRate, imu_samples_}, fixes};
}

std::string FilteredPoses::summary() {
  std::string text = fmt::format("{} samples of the IMU at {:.0f} Hz, {} fixes, {} heights; {}", imu_samples_,
                                 imu_rate(), fixes_, heights_, to_name(navigator_.health().status));
  for (const std::string& remark : remarks_) text += fmt::format("; {}", remark);
  return text;
}

}  // namespace pade::live
