#include "pade/navigation/integrity/yaw_witness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pade::navigation {
namespace {

constexpr double kChange = 1;         // s, over which a change is counted
constexpr double kGap = 2.5;          // s between velocities over which nothing is known
constexpr double kMemory = 20;        // s
constexpr double kForceError = 0.03;  // m/s², of tilt and bias together
constexpr double kLengths = 1.4;      // by which the two may differ
constexpr double kLeastCoherence = 0.8;
constexpr double kKnown = 0.2;     // rad; what is less certain may be noise, whose angle is any
constexpr double kWildSigmas = 4;  // sigmas

}  // namespace

void YawWitness::turned(double angle) {
  const Complex turn = std::polar(1.0, angle);
  inertial_ *= turn;
  open_.inertial *= turn;
  closed_.turn *= std::conj(turn);
}

/// Two measured velocities, and the force integrated.
double YawWitness::variance_of(double seconds) const {
  return 2 * sigma_ * sigma_ + kForceError * kForceError * seconds * seconds;
}

/// A velocity that jumps where nothing accelerates, or the other way round, tells nothing of the yaw.
bool YawWitness::is_plausible(const Open& change, double sigma) {
  const double measured = std::abs(change.measured);
  const double inertial = std::abs(change.inertial);
  return std::abs(measured - inertial) <
         (1 - 1 / kLengths) * std::max(measured, inertial) + kWildSigmas * sigma;
}

/// Noise has made the measured changes longer, by what is expected of it.
void YawWitness::add_open(Changes& sums) const {
  const double variance = variance_of(open_.seconds);
  if (!is_plausible(open_, std::sqrt(variance))) return;
  sums.turn += std::conj(open_.inertial) * open_.measured;
  sums.inertial += std::norm(open_.inertial);
  sums.measured += std::norm(open_.measured) - 2 * variance;
}

void YawWitness::close() {
  const double decay = std::exp(-open_.seconds / kMemory);
  closed_.turn *= decay;
  closed_.inertial *= decay;
  closed_.measured *= decay;
  add_open(closed_);
}

void YawWitness::velocity(const Vector3d& measured, double sigma, Time now) {
  const double dt = seconds_between(first_time_, now);
  if (has_velocity_ && dt < kGap) {
    open_.inertial = inertial_;
    open_.measured = complex(measured) - first_;
    open_.seconds = dt;
    sigma_ = sigma;
    if (dt < kChange - 1e-6) return;
    close();
  }
  has_velocity_ = true;
  first_ = complex(measured);
  first_time_ = now;
  inertial_ = 0;
  open_ = {};
}

YawWitness::Changes YawWitness::total() const {
  Changes all = closed_;
  if (open_.seconds > 0) add_open(all);
  return all;
}

bool YawWitness::is_clear() const {
  const Changes all = total();
  const double size = std::abs(all.turn);
  return sigma() < kKnown && size > all.inertial / kLengths && size < kLengths * all.inertial &&
         size * size > kLeastCoherence * all.inertial * all.measured;
}

double YawWitness::sigma() const {
  const double inertial = total().inertial;
  return inertial > 0 ? std::sqrt(variance_of(kChange) / inertial) : std::numeric_limits<double>::infinity();
}

}  // namespace pade::navigation
