#include "pade/navigation/navigator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "pade/core/option_check.hpp"
#include "pade/navigation/alignment.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/navigation/timeline.hpp"

namespace pade::navigation {
namespace {

using Image = std::shared_ptr<const CameraMotion>;

constexpr double kKeyframeInterval = 0.1;  // s
constexpr double kYawKnown = 0.125;        // rad, about 7°
constexpr double kMeasurementRate = 600;   // of all sensors together, Hz

std::size_t capacity(double seconds, double rate) {
  return static_cast<std::size_t>(std::ceil(seconds * rate)) + 8;
}

Time shifted(Time time, double seconds) {
  return Time{time.nanoseconds + Time::from_seconds(seconds).nanoseconds};
}

/// Standard deviations of a translation along itself and across: that along is of its length. Across it is
/// the scale of the tail of the error's norm: by moments |e|² is c χ², c = tr P² / tr P.
struct BaselineSigmas {
  double along = 0;   ///< m
  double across = 0;  ///< m
};

BaselineSigmas baseline_sigmas(const Vector3d& translation, const Matrix3d& covariance) {
  const Vector3d d = translation.normalized();
  const Matrix3d projector = Matrix3d::Identity() - d * d.transpose();
  const Matrix3d across = projector * covariance * projector;
  const double trace = across.trace();
  return {std::sqrt(std::max(0.0, d.dot(covariance * d))),
          trace > 0 ? std::sqrt(across.squaredNorm() / trace) : 0};
}

RawTally operator+(RawTally a, const RawTally& b) {
  const auto add = [](RawCounts& sum, const RawCounts& more) {
    sum.used += more.used;
    sum.refused += more.refused;
  };
  add(a.ranges, b.ranges);
  add(a.rates, b.rates);
  add(a.phases, b.phases);
  a.clock_jumps += b.clock_jumps;
  return a;
}

/// Buffers reach back over the history, the levelling window and what the bank of hypotheses waits for.
double buffered_seconds(const NavigatorOptions& options) {
  return options.history + options.alignment.level_time + options.alignment.motion_window +
         options.alignment.lag + 2;
}

}  // namespace

class Navigator::Core {
 public:
  explicit Core(const NavigatorOptions& options);

  void add(const ImuSample& sample);
  void add(Time stamp, double latency, Measurement::Value value, bool finite);
  void add(const CameraMotion& motion);
  RelativePose relative_pose(Time t1, Time t2, const Pose& T_body_camera);
  AbsolutePose absolute_pose(Time t);
  Health health();
  [[nodiscard]] const NavigatorOptions& options() const { return options_; }
  [[nodiscard]] RawTally raw_tally() const {
    return phase_ == AlignmentPhase::aligned ? tally_before_ + live_.core().raw.tally : tally_before_;
  }
  [[nodiscard]] CameraState camera() const {
    return phase_ == AlignmentPhase::aligned ? live_.core().camera : CameraState{};
  }
  [[nodiscard]] Time newest() const { return newest_; }
  void on_retired(std::function<void(const Measurement&)> sink) { sink_ = std::move(sink); }
  void retire(Time before);

 private:
  struct Keyframe {
    Time time;
    FilterSnapshot snapshot;
  };

  void advance_live(Time to);
  void replay_from(Time time);
  void restart();
  void restart_if_hopeless();
  void retire_oldest();
  bool load_scratch(Time t, Answer& answer);
  [[nodiscard]] Time imu_time(Time image) const;
  [[nodiscard]] NavigationStatus status_of(Filter& filter) const;

  NavigatorOptions options_;
  Timeline timeline_;
  Alignment alignment_;
  AlignmentPhase phase_ = AlignmentPhase::waiting;
  Filter live_;
  Filter scratch_;
  TimeRing<Keyframe> keyframes_;
  bool has_imu_ = false;
  Time newest_;
  Health health_;
  std::uint64_t times_lost_before_ = 0;  ///< the last restart
  std::uint64_t doubted_before_ = 0;
  std::uint64_t magnetometer_doubted_before_ = 0;
  RawTally tally_before_;
  std::function<void(const Measurement&)> sink_;
};

Navigator::Core::Core(const NavigatorOptions& options)
    : options_(options),
      timeline_(capacity(buffered_seconds(options), options.imu_rate),
                capacity(buffered_seconds(options), kMeasurementRate)),
      alignment_(options.filter, options.gnss_lever_arm, options.alignment),
      live_(options.filter, options.gnss_lever_arm),
      scratch_(options.filter, options.gnss_lever_arm),
      keyframes_(capacity(options.history + 2 * kKeyframeInterval, 1 / kKeyframeInterval)) {
  timeline_.declination = options.declination;
}

void Navigator::Core::restart() {
  if (phase_ == AlignmentPhase::aligned) {
    times_lost_before_ += static_cast<std::uint64_t>(live_.core().integrity.times_lost);
    doubted_before_ += static_cast<std::uint64_t>(live_.core().integrity.times_doubted);
    magnetometer_doubted_before_ +=
        static_cast<std::uint64_t>(live_.core().integrity.times_magnetometer_doubted);
    tally_before_ = tally_before_ + live_.core().raw.tally;
  }
  phase_ = AlignmentPhase::waiting;
  alignment_.reset();
  keyframes_.clear();
  ++health_.restarts;
}

void Navigator::Core::restart_if_hopeless() {
  // As it was when all late data had come, so that a restart does not depend on delays.
  const Time then = shifted(newest_, -options_.alignment.lag);
  const std::size_t known = keyframes_.count_until(then);
  if (known == 0 || !keyframes_[known - 1].snapshot.integrity.hopeless(then)) return;
  restart();
  ++health_.restarts_when_lost;
}

void Navigator::Core::add(const ImuSample& sample) {
  if (!sample.angular_rate.allFinite() || !sample.specific_force.allFinite() ||
      (has_imu_ && sample.time <= newest_)) {
    ++health_.imu_refused;
    return;
  }
  if (has_imu_) {
    const double interval = seconds_between(newest_, sample.time);
    if (interval > options_.filter.gap) ++health_.imu_gaps;
    if (interval > options_.longest_gap) {
      restart();
      timeline_.imu.clear();
    }
  }
  has_imu_ = true;
  newest_ = sample.time;
  timeline_.imu.push_back(sample);
  if (phase_ == AlignmentPhase::aligned) {
    advance_live(newest_);
    restart_if_hopeless();
  } else {
    phase_ = alignment_.update(timeline_, newest_);
    if (phase_ == AlignmentPhase::aligned) {
      live_ = alignment_.result();
      live_.watch();
      keyframes_.clear();
      keyframes_.push_back({live_.state().time, live_.snapshot()});
      advance_live(newest_);
    }
  }
  retire(shifted(newest_, -buffered_seconds(options_) + 1));
}

void Navigator::Core::advance_live(Time to) {
  timeline_.advance(live_, to, true, [this] {
    const Time now = live_.state().time;
    if (seconds_between(keyframes_.back().time, now) >= kKeyframeInterval - 1e-9) {
      keyframes_.push_back({now, live_.snapshot()});
    }
  });
}

void Navigator::Core::add(Time stamp, double latency, Measurement::Value value, bool finite) {
  if (!finite) {
    ++health_.unusable;
    return;
  }
  const Measurement measurement(shifted(stamp, -latency), std::move(value));
  if (has_imu_ && measurement.time > shifted(newest_, buffered_seconds(options_))) {
    ++health_.too_new;  // they would fill the buffer and never leave it
    return;
  }
  const bool aligned = phase_ == AlignmentPhase::aligned;
  if (aligned && measurement.time <= keyframes_.front().time) {
    ++health_.too_late;
    return;
  }
  auto place = timeline_.place_of(measurement);
  if (!place) {
    ++health_.duplicates;
    return;
  }
  if (timeline_.measurements.full()) {
    if (*place == 0) {
      ++health_.too_late;
      return;
    }
    retire_oldest();
    --*place;
  }
  timeline_.measurements.insert(*place, measurement);
  if (aligned) replay_from(measurement.time);
}

/// Uses what has been put into the timeline at a time that the filter has passed.
void Navigator::Core::replay_from(Time time) {
  if (time > live_.state().time) return;
  while (keyframes_.back().time >= time) keyframes_.pop_back();
  live_.restore(keyframes_.back().snapshot);
  advance_live(newest_);
}

void Navigator::Core::add(const CameraMotion& motion) {
  if (!options_.filter.camera || !is_usable(motion)) {
    ++health_.unusable;
    return;
  }
  auto stamped = std::make_shared<CameraMotion>(motion);
  stamped->t1 = imu_time(motion.t1);
  stamped->t2 = imu_time(motion.t2);
  auto& all = timeline_.measurements;
  const Measurement mark(stamped->t1, Image());
  const Measurement measured(stamped->t2, Image(stamped));
  const bool aligned = phase_ == AlignmentPhase::aligned;
  // An image at t1 that ends no motion has to be marked, and the filter to go back to it.
  const auto marked = timeline_.place_of(mark);
  const Time first = marked ? mark.time : measured.time;
  if (aligned && first <= keyframes_.front().time) {
    ++health_.too_late;
    return;
  }
  if (const auto place = timeline_.place_of(measured)) {
    all.insert(*place, measured);
  } else {
    // At t2 stands the mark of a later motion that came before this one, or this motion.
    std::size_t at = all.count_until(measured.time) - 1;
    while (all[at].kind() != SensorKind::camera) --at;
    if (*all[at].get_if<Image>()) {
      ++health_.duplicates;
      return;
    }
    all[at].value = Image(stamped);
  }
  if (const auto place = timeline_.place_of(mark)) all.insert(*place, mark);
  if (aligned) replay_from(first);
}

void Navigator::Core::retire(Time before) {
  while (!timeline_.measurements.empty() && timeline_.measurements.front().time < before) retire_oldest();
}

void Navigator::Core::retire_oldest() {
  const Measurement& oldest = timeline_.measurements.front();
  const auto* image = oldest.get_if<Image>();
  const bool is_mark = image != nullptr && !*image;
  if (sink_ && !is_mark) sink_(oldest);
  timeline_.measurements.pop_front();
}

Time Navigator::Core::imu_time(Time image) const { return shifted(image, options_.camera_time_offset); }

bool Navigator::Core::load_scratch(Time t, Answer& answer) {
  if (phase_ != AlignmentPhase::aligned) {
    answer = Answer::not_initialised;
  } else if (t > newest_) {
    answer = Answer::too_new;
  } else if (t < keyframes_.front().time) {
    answer = Answer::too_old;
  } else {
    answer = Answer::valid;
    scratch_.restore(keyframes_[keyframes_.count_until(t) - 1].snapshot);
    timeline_.advance(scratch_, t);
  }
  return answer == Answer::valid;
}

NavigationStatus Navigator::Core::status_of(Filter& filter) const {
  if (filter.core().integrity.lost) return NavigationStatus::lost;
  if (yaw_of(filter).sigma > kYawKnown) return NavigationStatus::levelled;
  const FilterCore& core = filter.core();
  if (!core.velocity_seen) return NavigationStatus::yaw_known;
  const double silence = seconds_between(core.velocity_accepted, core.state.time);
  return silence > options_.dead_reckoning_after ? NavigationStatus::dead_reckoning
                                                 : NavigationStatus::navigating;
}

RelativePose Navigator::Core::relative_pose(Time t1, Time t2, const Pose& T_body_camera) {
  RelativePose result;
  t1 = imu_time(t1);
  t2 = imu_time(t2);
  if (t1 > t2 || (has_imu_ && t2 > newest_)) {
    result.answer = Answer::too_new;
    return result;
  }
  if (!load_scratch(t1, result.answer)) return result;
  const int clone = scratch_.clone();
  timeline_.advance(scratch_, t2);
  const CloneMotion camera = scratch_.camera_motion_since(clone, T_body_camera);
  result.status = status_of(scratch_);

  const Pose& T = camera.T_1_2;
  const Matrix3d R = T.matrix3();
  // From the axes of the second frame to those of the first.
  Matrix6d turn = Matrix6d::Zero();  // (rotation, translation) -> (translation, rotation)
  turn.topRightCorner<3, 3>() = turn.bottomLeftCorner<3, 3>() = R;
  result.motion.R_reference_other = R;
  result.motion.t_reference_other = T.translation;
  result.motion.duration = seconds_between(t1, t2);
  result.motion.covariance = turn * camera.covariance * turn.transpose();
  const double baseline = T.translation.norm();
  const BaselineSigmas sigma = baseline_sigmas(T.translation, result.motion.covariance.topLeftCorner<3, 3>());
  const bool lost = scratch_.core().integrity.lost;  // then the covariance is refuted
  result.scale_valid =
      !lost && options_.scale_error_limit * baseline > options_.scale_error_sigmas * sigma.along;
  result.direction_valid =
      !lost && options_.direction_error_limit * baseline > options_.direction_error_sigmas * sigma.across;
  return result;
}

AbsolutePose Navigator::Core::absolute_pose(Time t) {
  AbsolutePose result;
  if (!load_scratch(imu_time(t), result.answer)) return result;
  const NavigationState& state = scratch_.state();
  const ExtendedPose smooth = scratch_.smooth_pose();
  result.T_world_body = {state.X.R, state.X.p};
  result.T_smooth_body = {smooth.R, smooth.p};
  result.velocity = state.X.v;
  result.covariance = scratch_.covariance().topLeftCorner<9, 9>();
  result.gyroscope_bias = state.gyroscope_bias;
  result.accelerometer_bias = state.accelerometer_bias;
  return result;
}

Health Navigator::Core::health() {
  if (phase_ == AlignmentPhase::waiting) {
    health_.status = NavigationStatus::uninitialised;
  } else if (phase_ == AlignmentPhase::levelled) {
    health_.status = NavigationStatus::levelled;
  } else {
    const Integrity& integrity = live_.core().integrity;
    health_.times_lost = times_lost_before_ + static_cast<std::uint64_t>(integrity.times_lost);
    health_.velocity_doubted = doubted_before_ + static_cast<std::uint64_t>(integrity.times_doubted);
    health_.magnetometer_doubted =
        magnetometer_doubted_before_ + static_cast<std::uint64_t>(integrity.times_magnetometer_doubted);
    scratch_.restore(live_.snapshot());
    health_.status = status_of(scratch_);
    health_.yaw_sigma = yaw_of(scratch_).sigma;
    health_.seconds_since_velocity = seconds_between(live_.core().velocity_accepted, live_.state().time);
    health_.seconds_since_position = seconds_between(live_.core().position_accepted, live_.state().time);
  }
  return health_;
}

Status check(const NavigatorOptions& o) {
  if (Status status = within("filter", check(o.filter)); !status) return status;
  if (Status status = within("alignment", check(o.alignment)); !status) return status;
  constexpr double kFar = 1e3;
  const OptionRange ranges[] = {
      {"gnss_lever_arm_x", o.gnss_lever_arm.x(), -kFar, kFar},
      {"gnss_lever_arm_y", o.gnss_lever_arm.y(), -kFar, kFar},
      {"gnss_lever_arm_z", o.gnss_lever_arm.z(), -kFar, kFar},
      {"gnss_position_latency", o.gnss_position_latency, -100, 100},
      {"gnss_velocity_latency", o.gnss_velocity_latency, -100, 100},
      {"barometer_latency", o.barometer_latency, -100, 100},
      {"magnetometer_latency", o.magnetometer_latency, -100, 100},
      {"camera_time_offset", o.camera_time_offset, -kFar, kFar},
      {"declination", o.declination, -std::numbers::pi, std::numbers::pi},
      {"history", o.history, above_zero, 60},
      {"imu_rate", o.imu_rate, 1, 1e5},
      {"dead_reckoning_after", o.dead_reckoning_after, above_zero},
      {"longest_gap", o.longest_gap, above_zero, 60},
      {"scale_error_limit", o.scale_error_limit, above_zero},
      {"scale_error_sigmas", o.scale_error_sigmas, 0, finite},
      {"direction_error_limit", o.direction_error_limit, above_zero},
      {"direction_error_sigmas", o.direction_error_sigmas, 0, finite},
  };
  return check_ranges(ranges);
}

Result<Navigator> Navigator::create(const NavigatorOptions& options) {
  if (const Status status = check(options); !status) return status.error();
  return Navigator(options);
}

Navigator::Navigator(const NavigatorOptions& options) : core_(std::make_unique<Core>(options)) {}
Navigator::Navigator(Navigator&&) noexcept = default;
Navigator& Navigator::operator=(Navigator&&) noexcept = default;
Navigator::~Navigator() = default;
const NavigatorOptions& Navigator::options() const { return core_->options(); }

void Navigator::add(const ImuSample& sample) { core_->add(sample); }
void Navigator::add(const GnssFix& measurement) {
  core_->add(measurement.time, core_->options().gnss_position_latency, measurement,
             measurement.position.allFinite() && measurement.covariance.allFinite());
}
void Navigator::add(const GnssVelocity& measurement) {
  core_->add(measurement.time, core_->options().gnss_velocity_latency, measurement,
             measurement.velocity.allFinite() && measurement.covariance.allFinite());
}
void Navigator::add(const BarometricHeight& measurement) {
  core_->add(measurement.time, core_->options().barometer_latency, measurement,
             std::isfinite(measurement.height) && std::isfinite(measurement.sigma));
}
void Navigator::add(const Heading& measurement) {
  core_->add(measurement.time, 0, measurement,
             std::isfinite(measurement.yaw) && std::isfinite(measurement.sigma));
}
void Navigator::add(const MagneticField& measurement) {
  core_->add(measurement.time, core_->options().magnetometer_latency, measurement,
             measurement.field.allFinite() && std::isfinite(measurement.sigma));
}
void Navigator::add(const ZeroVelocity& measurement) {
  core_->add(measurement.time, 0, measurement, std::isfinite(measurement.sigma));
}
void Navigator::add(const RangeToGround& measurement) {
  core_->add(measurement.time, 0, measurement,
             std::isfinite(measurement.range) && std::isfinite(measurement.sigma) &&
                 std::isfinite(measurement.ground_height));
}

void Navigator::add(const RoadMotion& measurement) {
  core_->add(measurement.time, 0, measurement, std::isfinite(measurement.sigma));
}

void Navigator::add(std::shared_ptr<const RawEpoch> measurement) {
  if (!measurement) return;
  const Time time = measurement->time;
  core_->add(time, core_->options().gnss_position_latency, std::move(measurement), true);
}

void Navigator::add(const CameraMotion& measurement) { core_->add(measurement); }

RelativePose Navigator::relative_pose(Time t1, Time t2, const Pose& T_body_camera) {
  return core_->relative_pose(t1, t2, T_body_camera);
}
AbsolutePose Navigator::absolute_pose(Time t) { return core_->absolute_pose(t); }
Health Navigator::health() { return core_->health(); }
RawTally Navigator::raw_tally() const { return core_->raw_tally(); }
CameraTally Navigator::camera_tally() const { return core_->camera().tally; }
Quaterniond Navigator::camera_mounting() const { return core_->camera().mounting; }
Time Navigator::newest() const { return core_->newest(); }
void Navigator::on_retired(std::function<void(const Measurement&)> sink) {
  core_->on_retired(std::move(sink));
}
void Navigator::finish() { core_->retire(Time{INT64_MAX}); }

}  // namespace pade::navigation
