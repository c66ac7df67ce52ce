#include "pade/navigation/integrity/integrity.hpp"

#include <algorithm>
#include <cmath>

namespace pade::navigation {
namespace {

constexpr double kFixAge = 1.5;       // s, for which a position can still rule
constexpr double kRulingSigmas = 4;   // between the two ways, of the difference of two positions
constexpr double kSettled = 3;        // s without an alarm
constexpr double kCalm = 9;           // of the mean square of three innovations; 3 is expected
constexpr int kMostOpenings = 3;      // in a row; then the errors are beyond what is linear
constexpr double kLostForGood = 10;   // s
constexpr double kFastAverage = 1.5;  // s
constexpr double kSlowAverage = 7.5;  // s
constexpr int kLeastPositions = 5;
constexpr double kClockDoubt = 0.05;  // s, by which stamps of the two may differ
constexpr double kSpeedMemory = 10;   // s
constexpr double kVelocityAge = 2.5;  // s, over which nobody knows the way between two velocities
constexpr double kOutlier = 4;        // sigmas
constexpr double kLeastDoubt = 0.05;  // m
constexpr double kAgreementRatio = 3;
constexpr double kShiftsApart = 8;      // s; jumps farther apart have nothing to do with each other
constexpr double kSameDirection = 0.7;  // cosine

bool calm(const InnovationWindow& window, Time now) {
  return window.empty() || seconds_between(window.newest(), now) > kSettled || window.level() < kCalm;
}

}  // namespace

void Dispute::advance(Time now, const Vector3d& measured, const Vector3d& predicted) {
  const double dt = seconds_between(time_, now);
  way_measured_ += 0.5 * dt * (measured_ + measured);
  way_predicted_ += 0.5 * dt * (predicted_ + predicted);
  time_ = now;
}

void Dispute::velocity(const Vector3d& measured, const Vector3d& predicted, Time now, bool parted) {
  if (has_velocity_ && seconds_between(velocity_time_, now) > kVelocityAge) has_fix_ = false;
  if (has_fix_ && has_velocity_) advance(now, measured, predicted);
  velocity_time_ = now;
  measured_ = measured;
  predicted_ = predicted;
  time_ = now;
  has_velocity_ = true;
  if (parted_ && !parted) has_fix_ = false;  // they agree again: begin at the next position
  parted_ = parted;
}

Dispute::Ruling Dispute::position(const Vector3d& measured, double white_sigma, Time now) {
  if (has_velocity_ && seconds_between(velocity_time_, now) > kVelocityAge) has_fix_ = false;
  if (has_velocity_ && has_fix_) advance(now, measured_, predicted_);
  fix_time_ = now;
  if (!parted_ || !has_fix_ || !has_velocity_) {
    fix_ = measured;
    time_ = now;
    way_measured_.setZero();
    way_predicted_.setZero();
    has_fix_ = true;
    return Ruling::none;
  }
  const Vector3d between = way_measured_ - way_predicted_;
  const double noise = kRulingSigmas * std::sqrt(2.0) * white_sigma;
  if (between.norm() < noise) return Ruling::none;
  const Vector3d beside_filter = measured - fix_ - way_predicted_;
  const bool filter_wrong = beside_filter.dot(between) > 0.5 * between.squaredNorm();
  // A position that lies on neither way is an outlier, or the first one was.
  const double miss = (filter_wrong ? Vector3d(beside_filter - between) : beside_filter).norm();
  if (miss > std::max(noise, 0.5 * between.norm())) return Ruling::none;
  return filter_wrong ? Ruling::filter_wrong : Ruling::velocity_wrong;
}

bool Dispute::can_rule(Time now) const { return has_fix_ && seconds_between(fix_time_, now) < kFixAge; }

void GnssAgreement::velocity(const Vector3d& measured, const Vector3d& axes, Time now) {
  if (axes != axes_) {  // the ways so far are of other axes
    axes_ = axes;
    positions_ = 0;
    ratio_ = 0;
  }
  const double dt = seconds_between(time_, now);
  if (has_velocity_ && dt > kVelocityAge) {  // a turn in the gap would look like positions led astray
    positions_ = 0;
    ratio_ = 0;
  }
  if (has_velocity_) way_ += 0.5 * dt * (velocity_ + measured);
  fastest_ = std::max(measured.norm(), has_velocity_ ? fastest_ * std::exp(-dt / kSpeedMemory) : 0);
  velocity_ = measured;
  time_ = now;
  has_velocity_ = true;
}

void GnssAgreement::position(const Vector3d& measured, const Vector3d& white, const Vector3d& walk,
                             Time now) {
  if (!has_velocity_) return;
  if (!hears_velocities(now)) {  // nothing is said, so nothing agrees either
    positions_ = 0;
    ratio_ = 0;
    return;
  }
  const Vector3d apart = axes_.cwiseProduct(measured - way_ - seconds_between(time_, now) * velocity_);
  const double dt = positions_ > 0 ? seconds_between(position_time_, now) : 0;
  position_time_ = now;
  if (positions_++ == 0) {
    fast_ = slow_ = apart;
    agrees_since_ = now;
  }
  const double averaged = std::min(1.0, dt / (2 * kFastAverage));
  const double doubt = kLeastDoubt + kClockDoubt * fastest_;
  // An outlier moves the averages no more than a bad position would.
  const double largest = kOutlier * (white.norm() + doubt);
  const auto follow = [&](Vector3d& average, double time) {
    const Vector3d step = apart - average;
    const double size = step.norm();
    average += (1 - std::exp(-dt / time)) * (size > largest ? Vector3d(step * (largest / size)) : step);
  };
  follow(fast_, kFastAverage);
  follow(slow_, kSlowAverage);
  const Vector3d variance = averaged * white.cwiseAbs2() + (kSlowAverage - kFastAverage) * walk.cwiseAbs2() +
                            Vector3d::Constant(doubt * doubt);
  ratio_ = positions_ < kLeastPositions ? 0 : (fast_ - slow_).cwiseQuotient(variance.cwiseSqrt()).norm();
  if (ratio_ > kAgreementRatio) agrees_since_ = now;
}

void GnssAgreement::jumped(const Vector3d& shift, Time now) {
  const bool on = seconds_between(last_shift_time_, now) < kShiftsApart &&
                  shift.dot(last_shift_) > kSameDirection * shift.norm() * last_shift_.norm();
  last_shift_ = shift;
  last_shift_time_ = now;
  if (on) return;
  positions_ = 0;
  ratio_ = 0;
}

bool GnssAgreement::hears_velocities(Time now) const {
  return has_velocity_ && !axes_.isZero(0) && seconds_between(time_, now) <= kVelocityAge;
}

double GnssAgreement::agreed(Time now) const {
  return positions_ < kLeastPositions ? 0 : seconds_between(agrees_since_, now);
}

void Integrity::raise(Time now) {
  if (!lost) {
    lost = true;
    lost_since = now;
    openings = 0;
    ++times_lost;
  }
  last_alarm = now;
}

void Integrity::settle(Time now) {
  if (!lost || seconds_between(last_alarm, now) < kSettled) return;
  lost = !(calm(velocity, now) && calm(position, now));
}

bool Integrity::hopeless(Time now) const {
  if (!lost || position_doubted) return false;
  if (!velocity_doubted && openings > kMostOpenings) return true;
  if (seconds_between(lost_since, now) < kLostForGood) return false;
  if (velocity_doubted) return !calm(position, now);
  // A new start is for what velocities and inertial sensors make of each other; a magnetometer or positions
  // that are led astray are no reason.
  return !calm(velocity, now) || seconds_between(last_opening, now) < kLostForGood / 2;
}

}  // namespace pade::navigation
