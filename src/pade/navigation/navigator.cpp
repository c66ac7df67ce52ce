#include "pade/navigation/navigator.hpp"

#include <algorithm>
#include <cmath>

namespace pade::navigation {
namespace {

constexpr double kKeyframeInterval = 0.1;  // s
constexpr double kYawKnown = 0.125;        // rad, about 7°

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

/// Buffers reach back over the history, the levelling window and what the bank of hypotheses waits for.
double buffered_seconds(const NavigatorOptions& options) {
  return options.history + options.alignment.level_time + options.alignment.motion_window +
         options.alignment.lag + 2;
}

}  // namespace

Navigator::Navigator(const NavigatorOptions& options)
    : options_(options),
      timeline_(capacity(buffered_seconds(options), options.imu_rate),
                capacity(buffered_seconds(options), 200)),
      alignment_(options.filter, options.gnss_lever_arm, options.alignment),
      live_(options.filter, options.gnss_lever_arm),
      scratch_(options.filter, options.gnss_lever_arm),
      keyframes_(capacity(options.history + 2 * kKeyframeInterval, 1 / kKeyframeInterval)) {
  timeline_.declination = options.declination;
}

void Navigator::restart() {
  phase_ = AlignmentPhase::waiting;
  alignment_.reset();
  keyframes_.clear();
  timeline_.imu.clear();
  ++health_.restarts;
}

void Navigator::add(const ImuSample& sample) {
  if (!sample.angular_rate.allFinite() || !sample.specific_force.allFinite() ||
      (has_imu_ && sample.time <= newest_)) {
    ++health_.imu_refused;
    return;
  }
  if (has_imu_) {
    const double interval = seconds_between(newest_, sample.time);
    if (interval > options_.filter.gap) ++health_.imu_gaps;
    if (interval > options_.longest_gap) restart();
  }
  has_imu_ = true;
  newest_ = sample.time;
  timeline_.imu.push_back(sample);
  if (phase_ == AlignmentPhase::aligned) {
    advance_live(newest_);
  } else {
    phase_ = alignment_.update(timeline_, newest_);
    if (phase_ == AlignmentPhase::aligned) {
      live_ = alignment_.result();
      keyframes_.clear();
      keyframes_.push_back({live_.state().time, live_.snapshot()});
      advance_live(newest_);
    }
  }
  retire(shifted(newest_, -buffered_seconds(options_) + 1));
}

void Navigator::advance_live(Time to) {
  timeline_.advance(live_, to, true, [this] {
    const Time now = live_.state().time;
    if (seconds_between(keyframes_.back().time, now) >= kKeyframeInterval - 1e-9) {
      keyframes_.push_back({now, live_.snapshot()});
    }
  });
}

void Navigator::add(Measurement measurement, double latency, bool finite) {
  if (!finite) {
    ++health_.unusable;
    return;
  }
  measurement.time = shifted(measurement.time, -latency);
  const bool aligned = phase_ == AlignmentPhase::aligned;
  if (aligned && measurement.time <= keyframes_.front().time) {
    ++health_.too_late;
    return;
  }
  const auto place = timeline_.place_of(measurement);
  if (!place) {
    ++health_.duplicates;
    return;
  }
  timeline_.measurements.insert(*place, measurement);
  if (!aligned || measurement.time > live_.state().time) return;
  while (keyframes_.back().time >= measurement.time) keyframes_.pop_back();
  live_.restore(keyframes_.back().snapshot);
  advance_live(newest_);
}

void Navigator::add(const GnssFix& measurement) {
  add(Measurement(measurement), options_.gnss_position_latency,
      measurement.position.allFinite() && measurement.covariance.allFinite());
}
void Navigator::add(const GnssVelocity& measurement) {
  add(Measurement(measurement), options_.gnss_velocity_latency,
      measurement.velocity.allFinite() && measurement.covariance.allFinite());
}
void Navigator::add(const BarometricHeight& measurement) {
  add(Measurement(measurement), options_.barometer_latency,
      std::isfinite(measurement.height) && std::isfinite(measurement.sigma));
}
void Navigator::add(const Heading& measurement) {
  add(Measurement(measurement), 0, std::isfinite(measurement.yaw) && std::isfinite(measurement.sigma));
}
void Navigator::add(const MagneticField& measurement) {
  add(Measurement(measurement), options_.magnetometer_latency,
      measurement.field.allFinite() && std::isfinite(measurement.sigma));
}
void Navigator::add(const ZeroVelocity& measurement) {
  add(Measurement(measurement), 0, std::isfinite(measurement.sigma));
}
void Navigator::add(const RangeToGround& measurement) {
  add(Measurement(measurement), 0,
      std::isfinite(measurement.range) && std::isfinite(measurement.sigma) &&
          std::isfinite(measurement.ground_height));
}

void Navigator::add(const RoadMotion& measurement) {
  add(Measurement(measurement), 0, std::isfinite(measurement.sigma));
}

void Navigator::retire(Time before) {
  while (!timeline_.measurements.empty() && timeline_.measurements.front().time < before) {
    if (sink_) sink_(timeline_.measurements.front());
    timeline_.measurements.pop_front();
  }
}

void Navigator::finish() { retire(Time{INT64_MAX}); }

Time Navigator::imu_time(Time image) const { return shifted(image, options_.camera_time_offset); }

bool Navigator::load_scratch(Time t, Answer& answer) {
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

NavigationStatus Navigator::status_of(Filter& filter) const {
  if (yaw_of(filter).sigma > kYawKnown) return NavigationStatus::levelled;
  const FilterCore& core = filter.core();
  if (!core.velocity_seen) return NavigationStatus::yaw_known;
  const double silence = seconds_between(core.velocity_accepted, core.state.time);
  return silence > options_.dead_reckoning_after ? NavigationStatus::dead_reckoning
                                                 : NavigationStatus::navigating;
}

RelativePose Navigator::relative_pose(Time t1, Time t2, const Pose& T_body_camera) {
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
  const CloneMotion body = scratch_.motion_since(clone);
  result.status = status_of(scratch_);

  const Pose T_camera_body = T_body_camera.inverse();
  const Pose T = T_camera_body * body.T_1_2 * T_body_camera;
  const Matrix3d R = T.matrix3();
  // ξ of the body at t2 to ξ of the camera, then from the axes of the second frame to those of the first.
  const Matrix6d Ad = adjoint(T_camera_body);
  const Matrix6d local = Ad * body.covariance * Ad.transpose();
  Matrix6d turn = Matrix6d::Zero();  // (rotation, translation) -> (translation, rotation)
  turn.topRightCorner<3, 3>() = turn.bottomLeftCorner<3, 3>() = R;
  result.motion.R_reference_other = R;
  result.motion.t_reference_other = T.translation;
  result.motion.duration = seconds_between(t1, t2);
  result.motion.covariance = turn * local * turn.transpose();
  const double baseline = T.translation.norm();
  const BaselineSigmas sigma = baseline_sigmas(T.translation, result.motion.covariance.topLeftCorner<3, 3>());
  result.scale_valid = options_.scale_error_limit * baseline > options_.scale_error_sigmas * sigma.along;
  result.direction_valid =
      options_.direction_error_limit * baseline > options_.direction_error_sigmas * sigma.across;
  return result;
}

AbsolutePose Navigator::absolute_pose(Time t) {
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

Health Navigator::health() {
  if (phase_ == AlignmentPhase::waiting) {
    health_.status = NavigationStatus::uninitialised;
  } else if (phase_ == AlignmentPhase::levelled) {
    health_.status = NavigationStatus::levelled;
  } else {
    scratch_.restore(live_.snapshot());
    health_.status = status_of(scratch_);
    health_.yaw_sigma = yaw_of(scratch_).sigma;
    health_.seconds_since_velocity = seconds_between(live_.core().velocity_accepted, live_.state().time);
    health_.seconds_since_position = seconds_between(live_.core().position_accepted, live_.state().time);
  }
  return health_;
}

}  // namespace pade::navigation
