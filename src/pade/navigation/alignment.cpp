#include "pade/navigation/alignment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pade::navigation {
namespace {

constexpr double kLookInterval = 0.1;      // s
constexpr double kHopeless = 15;           // log-likelihood behind the best at which a hypothesis is dropped
constexpr double kUnknownPosition = 1e4;   // m
constexpr double kStartDistance = 5;       // flown between the fix and the start, m
constexpr double kMotionTiltSigma = 0.08;  // of the first level in motion, rad
constexpr double kMotionForceDoubt = 0.3;  // m/s²
constexpr double kRestRateSigma = 2e-3;    // of the mean rate at rest, rad/s
constexpr double kRestForceSigma = 0.06;   // of the mean force at rest, m/s²
constexpr double kRestVelocitySigma = 0.05;  // m/s
constexpr double kCruise = 30;               // without turning or shaking, what a vehicle may fly at, m/s

Vector3d yaw_axis(const Quaterniond& R) {
  const bool upright = std::abs((R * Vector3d::UnitX()).z()) < 0.94;
  return upright ? Vector3d::UnitX() : Vector3d::UnitY();
}

double azimuth(const Vector3d& w) { return std::atan2(w.y(), w.x()); }

/// The rotation by which the measured up direction of the body becomes `up` of the world, at the given yaw.
Quaterniond attitude(const Vector3d& measured, const Vector3d& up, double yaw) {
  const Quaterniond level = rotation_between(measured, Vector3d::UnitZ());
  const double turn = yaw - azimuth(level * yaw_axis(level));
  const Quaterniond turned = rotation_exp({0, 0, turn}) * level;
  return (rotation_between(turned * measured, up) * turned).normalized();
}

/// Covariance of φ for independent errors about the world's axes.
Matrix3d attitude_covariance(const Quaterniond& R, double tilt_sigma, double yaw_sigma) {
  const Matrix3d rotation = R.toRotationMatrix();
  const Vector3d variance(tilt_sigma * tilt_sigma, tilt_sigma * tilt_sigma, yaw_sigma * yaw_sigma);
  return rotation.transpose() * variance.asDiagonal() * rotation;
}

/// The velocity of the antenna that a measurement gives, if it gives one.
std::optional<GnssVelocity> velocity_in(const Measurement& m) {
  if (const auto* raw = m.get_if<std::shared_ptr<const RawEpoch>>()) return (*raw)->velocity;
  if (const auto* velocity = m.get_if<GnssVelocity>()) return *velocity;
  return std::nullopt;
}

/// Faster than the noise of what is measured of it explains.
bool shows_motion(const GnssVelocity& velocity, double rest_speed) {
  const Vector3d axes = measured_axes(velocity);
  const double variance = axes.cwiseProduct(velocity.covariance.diagonal()).sum();
  return axes.cwiseProduct(velocity.velocity).norm() > rest_speed + 3 * std::sqrt(variance);
}

std::optional<GnssFix> fix_in(const Measurement& m) {
  if (const auto* raw = m.get_if<std::shared_ptr<const RawEpoch>>()) return (*raw)->fix;
  if (const auto* fix = m.get_if<GnssFix>()) return *fix;
  return std::nullopt;
}

/// The last velocity or fix in [from, to], with its stamp on the filter's time scale.
template <class Get>
auto last_gnss(const Timeline& timeline, Time from, Time to, const Get& get) {
  for (std::size_t i = timeline.measurements.count_until(to);
       i-- > 0 && timeline.measurements[i].time >= from;) {
    if (auto found = get(timeline.measurements[i])) {
      found->time = timeline.measurements[i].time;
      return found;
    }
  }
  return decltype(get(timeline.measurements[0])){};
}

/// The last measurement of a sensor in [from, to].
template <class Sensor>
const Sensor* last_of(const Timeline& timeline, Time from, Time to) {
  for (std::size_t i = timeline.measurements.count_until(to);
       i-- > 0 && timeline.measurements[i].time >= from;) {
    if (const auto* found = timeline.measurements[i].get_if<Sensor>()) return found;
  }
  return nullptr;
}

BaseMatrix prior(const FilterOptions& options, const Quaterniond& R, double tilt_sigma, double yaw_sigma,
                 double velocity_sigma) {
  BaseMatrix P = BaseMatrix::Zero();
  const auto set = [&](int first, double sigma) {
    P.diagonal().segment<3>(first).setConstant(sigma * sigma);
  };
  P.block<3, 3>(kPhi, kPhi) = attitude_covariance(R, tilt_sigma, yaw_sigma);
  set(kNu, velocity_sigma);
  set(kRho, kUnknownPosition);
  set(kGyroscopeBias, options.gyroscope_bias_sigma);
  set(kAccelerometerBias, options.accelerometer_bias_sigma);
  set(kIron, options.iron_sigma);
  return P;
}

Time earlier(Time time, double seconds) {
  return Time{time.nanoseconds - Time::from_seconds(seconds).nanoseconds};
}

/// How the gyroscopes have turned from one time to a later one: axes of the later one in those of the first.
Quaterniond turned(const Timeline& timeline, Time from, Time to) {
  Quaterniond turn = Quaterniond::Identity();
  Time time = from;
  for (std::size_t i = timeline.imu.count_until(from); i < timeline.imu.size() && time < to; ++i) {
    const ImuSample& sample = timeline.imu[i];
    const Time until = std::min(sample.time, to);
    turn = turn * rotation_exp(seconds_between(time, until) * sample.angular_rate);
    time = until;
  }
  return turn.normalized();
}

/// The last heading that is still at hand, carried on by the gyroscopes to a time at which the attitude is R
/// but for the yaw.
/// @param R  with the yaw 0
std::optional<Yaw> carried_heading(const Timeline& timeline, Time until, Time at, const Quaterniond& R,
                                   double rate_sigma) {
  const auto* heading = last_of<Heading>(timeline, Time{INT64_MIN}, until);
  if (heading == nullptr) return std::nullopt;
  const Quaterniond then = heading->time < at ? R * turned(timeline, heading->time, at).conjugate()
                                              : R * turned(timeline, at, heading->time);
  const double drift = rate_sigma * std::abs(seconds_between(heading->time, at));
  return Yaw{heading->yaw - azimuth(then * yaw_axis(then)), std::hypot(heading->sigma, drift)};
}

}  // namespace

std::optional<RestMeans> detect_rest(const Timeline& timeline, Time now, const AlignmentOptions& options) {
  const Time from = earlier(now, options.level_time);
  const std::size_t begin = timeline.imu.count_until(from);
  const std::size_t end = timeline.imu.count_until(now);
  if (begin == 0 || end < begin + 20) return std::nullopt;  // the window must be covered
  Vector3d rate = Vector3d::Zero();
  Vector3d force = Vector3d::Zero();
  for (std::size_t i = begin; i < end; ++i) {
    rate += timeline.imu[i].angular_rate;
    force += timeline.imu[i].specific_force;
  }
  const auto count = static_cast<double>(end - begin);
  rate /= count;
  force /= count;
  Vector3d rate_square = Vector3d::Zero();
  Vector3d force_square = Vector3d::Zero();
  for (std::size_t i = begin; i < end; ++i) {
    rate_square += (timeline.imu[i].angular_rate - rate).cwiseAbs2();
    force_square += (timeline.imu[i].specific_force - force).cwiseAbs2();
  }
  const auto limit = [&](double sigma) { return sigma * sigma * count; };
  if (rate_square.maxCoeff() > limit(options.rest_rate_sigma)) return std::nullopt;
  if (force_square.maxCoeff() > limit(options.rest_force_sigma)) return std::nullopt;
  for (std::size_t i = timeline.measurements.count_until(now);
       i-- > 0 && timeline.measurements[i].time > from;) {
    const Measurement& m = timeline.measurements[i];
    const auto velocity = velocity_in(m);
    if (!velocity) continue;
    if (shows_motion(*velocity, options.rest_speed)) return std::nullopt;
  }
  return RestMeans{now, rate, force, options.level_time};
}

void start_at_rest(Filter& filter, const RestMeans& rest, double yaw, double yaw_sigma,
                   double velocity_sigma) {
  NavigationState state;
  state.time = rest.time;
  state.X.R = attitude(rest.specific_force, Vector3d::UnitZ(), yaw);
  state.gyroscope_bias = rest.angular_rate;
  constexpr double kAnyTilt = 0.5;
  BaseMatrix P = prior(filter.options(), state.X.R, kAnyTilt, yaw_sigma, velocity_sigma);
  const double rate_sigma = kRestRateSigma;
  P.diagonal().segment<3>(kGyroscopeBias).setConstant(rate_sigma * rate_sigma);
  filter.start(state, P);
  // The update ties tilt to accelerometer bias as they are tied in truth: only their sum was seen.
  filter.update_static_force(rest.specific_force, kRestForceSigma);
}

Yaw yaw_of(Filter& filter) {
  const BaseMatrix P = filter.covariance();
  const Quaterniond R = filter.state().X.R;
  const Eigen::RowVector3d up = R.toRotationMatrix().row(2);
  return {azimuth(R * yaw_axis(R)),
          std::sqrt(std::max(0.0, (up * P.block<3, 3>(kPhi, kPhi) * up.transpose()).value()))};
}

Alignment::Alignment(const FilterOptions& filter, const Vector3d& lever_arm, const AlignmentOptions& options)
    : options_(options), bank_(static_cast<std::size_t>(std::max(1, options.hypotheses))) {
  for (Hypothesis& hypothesis : bank_) hypothesis.filter = Filter(filter, lever_arm);
}

void Alignment::reset() {
  running_ = started_clock_ = yaw_measured_ = false;
  begins_anew_ = true;
  best_ = 0;
}

bool Alignment::start_from_rest(Timeline& timeline, Time now) {
  const auto rest = detect_rest(timeline, now, options_);
  if (!rest) return false;
  const Time from = earlier(now, options_.level_time);
  std::optional<Yaw> yaw;
  if (const auto* heading = last_of<Heading>(timeline, from, now)) {
    yaw = Yaw{heading->yaw, heading->sigma};
  } else if (const auto carried =
                 carried_heading(timeline, now, now, attitude(rest->specific_force, Vector3d::UnitZ(), 0),
                                 bank_.front().filter.options().gyroscope_bias_sigma)) {
    yaw = carried;
  } else if (const auto* field = last_of<MagneticField>(timeline, from, now)) {
    const Quaterniond level = attitude(rest->specific_force, Vector3d::UnitZ(), 0);
    const double north = 0.5 * std::numbers::pi - timeline.declination;
    yaw = Yaw{north - azimuth(level * field->field), options_.heading_sigma_magnetic};
  }
  // What neither turns nor shakes may cruise: after a start in flight only a velocity says that it does not.
  const bool known = !begins_anew_ || last_gnss(timeline, from, now, velocity_in).has_value();
  const double spacing = 2 * std::numbers::pi / static_cast<double>(bank_.size());
  for (std::size_t i = 0; i < bank_.size(); ++i) {
    bank_[i].alive = !yaw || i == 0;
    if (!bank_[i].alive) continue;
    start_at_rest(bank_[i].filter, *rest, yaw ? yaw->angle : static_cast<double>(i) * spacing,
                  yaw ? yaw->sigma : 0.6 * spacing, known ? kRestVelocitySigma : kCruise);
  }
  yaw_measured_ = yaw.has_value();
  return true;
}

bool Alignment::is_moving(const Timeline& timeline, Time now) const {
  const auto last = last_gnss(timeline, earlier(now, 0.5), now, velocity_in);
  return last && shows_motion(*last, options_.rest_speed);
}

bool Alignment::start_in_motion(Timeline& timeline, Time now) {
  // Two velocities a window apart: R_0 Δv = v_1 - v_0 - g T gives the direction of "up" as the body felt it.
  const auto last = last_gnss(timeline, earlier(now, 0.5), now, velocity_in);
  if (!last) return false;
  const Time from = earlier(last->time, options_.motion_window);
  const auto first = last_gnss(timeline, earlier(from, 0.5), from, velocity_in);
  if (!first) return false;
  const std::size_t begin = timeline.imu.count_until(first->time);
  const std::size_t end = timeline.imu.count_until(last->time);
  if (begin == 0 || end < begin + 5) return false;
  ImuIncrement increment;
  Time time = first->time;
  for (std::size_t i = begin; i < end; ++i) {
    const double dt = seconds_between(time, timeline.imu[i].time);
    if (dt > 0)
      accumulate(increment, imu_step(timeline.imu[i].angular_rate, timeline.imu[i].specific_force, dt), dt,
                 Vector3d::Zero(), Vector3d::Zero());
    time = timeline.imu[i].time;
  }
  const FilterOptions& filter_options = bank_.front().filter.options();
  const Vector3d up =
      last->velocity - first->velocity + Vector3d(0, 0, filter_options.gravity * increment.duration);
  const std::optional<Yaw> yaw = carried_heading(timeline, now, first->time, attitude(increment.v, up, 0),
                                                 filter_options.gyroscope_bias_sigma);
  const double spacing = 2 * std::numbers::pi / static_cast<double>(bank_.size());
  for (std::size_t i = 0; i < bank_.size(); ++i) {
    bank_[i].alive = !yaw || i == 0;
    if (!bank_[i].alive) continue;
    NavigationState state;
    state.time = time;
    const Quaterniond R0 = attitude(increment.v, up, yaw ? yaw->angle : static_cast<double>(i) * spacing);
    state.X.R = (R0 * Quaterniond(increment.R)).normalized();
    state.X.v = last->velocity;
    const double tilt = std::hypot(kMotionTiltSigma, kMotionForceDoubt / filter_options.gravity);
    const double velocity_sigma = std::sqrt(last->covariance.trace());
    bank_[i].filter.start(
        state, prior(filter_options, state.X.R, tilt, yaw ? yaw->sigma : 0.6 * spacing, velocity_sigma));
  }
  yaw_measured_ = yaw.has_value();
  return true;
}

AlignmentPhase Alignment::update(Timeline& timeline, Time now) {
  // Everything looks at a moment in the past by which late data has come: the start does not depend on
  // delays.
  const Time until = earlier(now, options_.lag);
  if (!started_clock_) {
    started_clock_ = true;
    first_ = last_look_ = now;
  }
  if (seconds_between(last_look_, now) < kLookInterval)
    return running_ ? AlignmentPhase::levelled : AlignmentPhase::waiting;
  last_look_ = now;
  if (!running_) {
    const bool rested = start_from_rest(timeline, until);
    // A vehicle that may yet come to rest, or be found at rest, is given the time to show it.
    const bool waited = seconds_between(first_, until) > options_.level_time + 2 * kLookInterval;
    running_ = rested || ((waited || is_moving(timeline, until)) && start_in_motion(timeline, until));
    if (!running_) return AlignmentPhase::waiting;
    begin_at_first_fix(timeline, until);
    if (yaw_measured_) return AlignmentPhase::aligned;
  }
  for (Hypothesis& hypothesis : bank_) {
    if (hypothesis.alive && hypothesis.filter.state().time < until)
      timeline.advance(hypothesis.filter, until);
  }
  return weigh();
}

void Alignment::begin_at_first_fix(const Timeline& timeline, Time until) {
  // Far from the origin the gate of the first fix would close.
  const auto fix = last_gnss(timeline, Time{INT64_MIN}, until, fix_in);
  const double variance =
      fix ? fix->covariance.trace() : 0;  // without one the vehicle is the origin, for now
  for (Hypothesis& hypothesis : bank_) {
    if (!hypothesis.alive) continue;
    FilterSnapshot snapshot = hypothesis.filter.snapshot();
    if (fix) snapshot.state.X.p = fix->position;
    // Nor must an almost unknown position meet a barometer: it would tie height to all that moves the
    // horizon. A first fix that comes later is believed within a second, however far it is.
    snapshot.P.block<3, 3>(kRho, kRho) = (variance + kStartDistance * kStartDistance) * Matrix3d::Identity();
    hypothesis.filter.restore(snapshot);
  }
}

AlignmentPhase Alignment::weigh() {
  double best = -1e300;
  for (std::size_t i = 0; i < bank_.size(); ++i) {
    if (bank_[i].alive && bank_[i].filter.core().log_likelihood > best) {
      best = bank_[i].filter.core().log_likelihood;
      best_ = i;
    }
  }
  const double centre = yaw_of(bank_[best_].filter).angle;
  double total = 0;
  double spread = 0;
  for (Hypothesis& hypothesis : bank_) {
    if (!hypothesis.alive) continue;
    const double behind = best - hypothesis.filter.core().log_likelihood;
    if (behind > kHopeless) {
      hypothesis.alive = false;
      continue;
    }
    const double weight = std::exp(-behind);
    const Yaw yaw = yaw_of(hypothesis.filter);
    const double difference = std::remainder(yaw.angle - centre, 2 * std::numbers::pi);
    total += weight;
    spread += weight * (difference * difference + yaw.sigma * yaw.sigma);
  }
  return std::sqrt(spread / total) < options_.yaw_known ? AlignmentPhase::aligned : AlignmentPhase::levelled;
}

}  // namespace pade::navigation
