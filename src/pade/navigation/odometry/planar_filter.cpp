#include "pade/navigation/odometry/planar_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include "pade/core/option_check.hpp"
#include "pade/navigation/tight/raw_median.hpp"
#include "pade/navigation/tight/raw_models.hpp"

namespace pade::navigation {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double kStartSigma = 100;       // of the position that a start is given, m
constexpr double kStartClockSigma = 100;  // of a clock taken from a median of ranges, m
constexpr double kStartDriftSigma = 300;  // of its drift: 1 ppm, m/s
constexpr double kStartSystemSigma = 50;  // of a system's bias, taken likewise, m
constexpr double kPause = 60;  // s without odometry, after which nothing of the motion is known any more
constexpr double kFirstInterval = 1;  // s: the first epoch, which no other checks, is not all that is known
constexpr int kRounds = 4;            // of weighing: more move the estimate by centimetres
constexpr double kYawLost = 2.5;      // times `yaw_known`: beyond it the yaw is not known any more

Matrix2d turned_by(double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }

/// The derivative of a rotation by its angle at zero.
Matrix2d quarter_turn() { return (Matrix2d() << 0, -1, 1, 0).finished(); }

}  // namespace

Status check(const PlanarOptions& o) {
  const OptionRange ranges[] = {
      {"scale_sigma", o.scale_sigma, above_zero, 1},
      {"scale_walk", o.scale_walk, 0, finite},
      {"yaw_rate_bias_sigma", o.yaw_rate_bias_sigma, 0, finite},
      {"yaw_rate_bias_walk", o.yaw_rate_bias_walk, 0, finite},
      {"yaw_noise", o.yaw_noise, 0, finite},
      {"turn_noise", o.turn_noise, 0, finite},
      {"path_noise", o.path_noise, 0, finite},
      {"height_walk", o.height_walk, 0, finite},
      {"gap", o.gap, above_zero, finite},
      {"gap_acceleration", o.gap_acceleration, 0, finite},
      {"gap_yaw_rate", o.gap_yaw_rate, 0, finite},
      {"clock_noise", o.clock_noise, 0, finite},
      {"clock_drift_walk", o.clock_drift_walk, 0, finite},
      {"correlation_time", o.correlation_time, 0, finite},
      {"gate", o.gate, 1, finite},
      {"doubt", o.doubt, 0, finite},
      {"reacquire_after", o.reacquire_after, 0},
      {"yaw_known", o.yaw_known, above_zero, 0.5},
  };
  return check_ranges(ranges);
}

void PlanarFilter::start(Time time, const Vector3d& position) {
  const PlanarTally tally = tally_;
  const std::optional<Time> last_epoch = last_epoch_, gap = gap_since_;
  *this = PlanarFilter(options_);
  tally_ = tally;
  last_epoch_ = last_epoch;
  gap_since_ = gap;
  started_ = true;
  time_ = agreed_ = time;
  position_ = position;
  PlanarVector sigma = PlanarVector::Zero();
  sigma.head<3>().setConstant(kStartSigma);
  // A vector of length 1 in an unknown direction has the mean 0 and this spread.
  sigma.segment<2>(kPlanarHeading).setConstant(std::numbers::sqrt2 / 2);
  sigma[kPlanarBias] = options_.yaw_rate_bias_sigma;
  P_ = sigma.cwiseAbs2().asDiagonal();
}

PlanarVector PlanarFilter::state() const {
  PlanarVector x;
  x << position_, heading_, bias_, receiver_.clock, receiver_.drift, receiver_.system_bias;
  return x;
}

Vector2d PlanarFilter::direction(double angle) const { return turned_by(angle) * heading_; }

void PlanarFilter::turn_noise(double variance) {
  // Exact for a rotation by a Gaussian angle: the mean shrinks, the deviation of the second moment from a
  // circle twice as fast, and what the mean loses the spread gains. After much of it the yaw is unknown
  // again.
  if (variance <= 0) return;
  auto spread = P_.block<2, 2>(kPlanarHeading, kPlanarHeading);
  const Matrix2d moment = spread + heading_ * heading_.transpose();
  const Matrix2d circle = 0.5 * moment.trace() * Matrix2d::Identity();
  const double shrink = std::exp(-0.5 * variance);
  const Matrix2d turned = circle + std::pow(shrink, 4) * (moment - circle);
  heading_ *= shrink;
  P_.middleRows<2>(kPlanarHeading) *= shrink;
  P_.middleCols<2>(kPlanarHeading) *= shrink;
  spread = turned - heading_ * heading_.transpose();
}

void PlanarFilter::propagate(Time to, const PlanarOdometry& mean) {
  const double T = seconds_between(time_, to);
  if (!started_ || !(T > 0)) return;
  const double until = seconds_between(mean.time, to);
  if (until > options_.gap && gap_since_ != mean.time) {
    ++tally_.gaps;
    gap_since_ = mean.time;
  }
  if (until > kPause) {
    started_ = false;
    return;
  }
  const Vector2d way = T * mean.speed * direction(turned_ + 0.5 * mean.yaw_rate * T);
  const Matrix2d back = turned_by(-bias_ * T);
  PlanarMatrix F = PlanarMatrix::Identity();
  F.block<2, 2>(0, kPlanarHeading) = T * mean.speed * turned_by(turned_ + 0.5 * mean.yaw_rate * T);
  F.block<2, 2>(kPlanarHeading, kPlanarHeading) = back;
  F.block<2, 1>(kPlanarHeading, kPlanarBias) = -T * quarter_turn() * back * heading_;
  F(kPlanarClock, kPlanarDrift) = T;
  position_.head<2>() += way;
  heading_ = back * heading_;
  turned_ = std::remainder(turned_ + mean.yaw_rate * T, 2 * std::numbers::pi);
  speed_ = mean.speed;
  receiver_.clock += T * receiver_.drift;
  time_ = to;
  P_ = (F * P_ * F.transpose()).eval();

  const double slip = options_.path_noise * options_.path_noise * T + std::pow(mean.speed_sigma * T, 2);
  double turn = options_.yaw_noise * options_.yaw_noise * T + std::pow(mean.yaw_rate_sigma * T, 2) +
                options_.turn_noise * options_.turn_noise * std::abs(mean.yaw_rate) * T;
  // Within a gap the speed runs away: the same noise in one step as in many.
  const double since = std::max(options_.gap, until - T);
  double unseen = 0;
  if (until > options_.gap) {
    unseen = std::pow(0.5 * options_.gap_acceleration, 2) * (std::pow(until, 4) - std::pow(since, 4));
    turn += options_.gap_yaw_rate * options_.gap_yaw_rate * (until * until - since * since);
  }
  P_.diagonal().head<2>().array() += slip + unseen;
  P_(2, 2) += options_.height_walk * options_.height_walk * T;
  turn_noise(turn);
  P_.block<2, 2>(kPlanarHeading, kPlanarHeading) +=
      options_.scale_walk * options_.scale_walk * T * heading_ * heading_.transpose();
  P_(kPlanarBias, kPlanarBias) += options_.yaw_rate_bias_walk * options_.yaw_rate_bias_walk * T;
  const double walk = options_.clock_drift_walk * options_.clock_drift_walk;
  P_(kPlanarClock, kPlanarClock) += options_.clock_noise * options_.clock_noise * T + walk * T * T * T / 3;
  P_(kPlanarClock, kPlanarDrift) += walk * T * T / 2;
  P_(kPlanarDrift, kPlanarClock) += walk * T * T / 2;
  P_(kPlanarDrift, kPlanarDrift) += walk * T;
}

RawVariables PlanarFilter::raw_variables() const {
  RawVariables x;
  x.position = position_;
  x.velocity.head<2>() = speed_ * direction(turned_);
  x.receiver = receiver_;
  return x;
}

void PlanarFilter::start_receiver(const RawEpoch& epoch) {
  // A median of ranges from a position that is wrong is as wrong as that.
  const double place = P_.topLeftCorner<3, 3>().trace();
  const auto set_prior = [&](int index, double sigma) {
    P_.row(index).setZero();
    P_.col(index).setZero();
    P_(index, index) = sigma * sigma + (index == kPlanarDrift ? 0 : place);
  };
  const auto common = [&](std::size_t system) {
    const RawVariables x = raw_variables();
    Median ranges;
    for (const RawSatellite& s : satellites_of(epoch)) {
      if (s.range && static_cast<std::size_t>(s.satellite.system) == system) {
        ranges.add(*s.range - predict_range(x, s).value);
      }
    }
    return ranges;
  };
  for (std::size_t system = 0; system < gnss::kSystems && !clock_known_; ++system) {
    Median ranges = common(system);
    if (ranges.count() == 0) continue;
    clock_known_ = true;
    receiver_.clock += ranges.value();
    set_prior(kPlanarClock, kStartClockSigma);
    set_prior(kPlanarDrift, kStartDriftSigma);
  }
  for (std::size_t system = 1; system < gnss::kSystems && clock_known_; ++system) {
    if (system_known_.at(system - 1)) continue;
    Median ranges = common(system);
    if (ranges.count() == 0) continue;
    system_known_.at(system - 1) = true;
    const int index = static_cast<int>(system) - 1;
    receiver_.system_bias[index] += ranges.value();
    set_prior(kPlanarSystemBias + index, kStartSystemSigma);
  }
}

void PlanarFilter::follow_clock_jump(const RawEpoch& epoch) {
  const RawVariables x = raw_variables();
  Median residuals;
  for (const RawSatellite& s : satellites_of(epoch)) {
    if (s.range) residuals.add(*s.range - predict_range(x, s).value);
  }
  const double jump = jump_of(residuals);
  receiver_.clock += jump;
  if (jump != 0) ++tally_.clock_jumps;
}

double PlanarFilter::share_of(double u) const {
  if (options_.doubt <= 0) return 1;
  // A reflection is late, without bound; that a signal comes too early is noise.
  if (u < 0 && options_.only_late) return std::min(1.0, options_.doubt / -u);
  return 1 / (1 + std::pow(u / options_.doubt, 2));
}

double PlanarFilter::lasting(Time time) {
  const double interval = last_epoch_ ? seconds_between(*last_epoch_, time) : 0;
  last_epoch_ = time;
  // So that all epochs within the correlation time tell together what one of them does.
  return std::max(1.0, 2 * options_.correlation_time / (interval > 0 ? interval : kFirstInterval));
}

void PlanarFilter::apply(const PlanarVector& error) {
  position_ += error.head<3>();
  heading_ += error.segment<2>(kPlanarHeading);
  bias_ += error[kPlanarBias];
  ReceiverVector receiver = ReceiverVector::Zero();
  receiver.head<5>() = error.segment<5>(kPlanarReceiver);
  receiver_.retract(receiver);
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  know_scale();
}

void PlanarFilter::know_scale() {
  const PlanarEstimate now = estimate();
  if (now.yaw_sigma > kYawLost * options_.yaw_known) scale_known_ = false;
  if (scale_known_ || now.yaw_sigma > options_.yaw_known) return;
  // The direction is known: along it the wheels say how long the vector is.
  scale_known_ = true;
  const Vector2d along = heading_.normalized();
  const PlanarVector spread = P_.middleCols<2>(kPlanarHeading) * along;
  const double own = along.dot(spread.segment<2>(kPlanarHeading));
  const PlanarVector gain = spread / (own + options_.scale_sigma * options_.scale_sigma);
  const double short_by = 1 - heading_.norm();
  P_ -= gain * spread.transpose();
  apply(gain * short_by);
}

void PlanarFilter::believe_again(const RawEpoch& epoch) {
  if (!epoch.fix || !epoch.fix->position.allFinite() ||
      seconds_between(agreed_, epoch.time) < options_.reacquire_after) {
    return;
  }
  const Vector3d apart = epoch.fix->position - position_;
  P_.topLeftCorner<3, 3>().diagonal() += apart.cwiseAbs2() + Vector3d::Constant(kStartSigma * kStartSigma);
  clock_known_ = false;  // and is found anew, as are the biases of the systems
  system_known_.fill(false);
  agreed_ = epoch.time;
  ++tally_.reacquired;
}

std::vector<RangeShare> PlanarFilter::update(const RawEpoch& epoch) {
  std::vector<RangeShare> shares;
  if (!started_) return shares;
  if (last_epoch_ && epoch.time <= *last_epoch_) {
    ++tally_.untimely;
    return shares;
  }
  start_receiver(epoch);
  if (!clock_known_) return shares;
  follow_clock_jump(epoch);
  const RawVariables x = raw_variables();
  const double factor = lasting(epoch.time);
  RawEquations equations;
  std::array<double, kMostSatellites> variances{};
  for (const RawSatellite& s : satellites_of(epoch)) {
    if (!s.range) continue;
    const RawPrediction predicted = predict_range(x, s);
    variances.at(equations.size) = s.range_sigma * s.range_sigma;
    RawEquation& e = equations.add();
    e.residual = *s.range - predicted.value;
    e.variance = factor * s.range_sigma * s.range_sigma;
    e.row = predicted.row;
    shares.push_back({s.satellite, 1, 0});
  }
  Cross C = Cross::Zero();
  C.leftCols<3>() = P_.leftCols<3>();
  C.middleCols<5>(kOfReceiver) = P_.middleCols<5>(kPlanarReceiver);
  RawMatrix S = RawMatrix::Zero();
  S.topRows<3>() = C.topRows<3>();
  S.middleRows<5>(kOfReceiver) = C.middleRows<5>(kPlanarReceiver);
  RawInformation information = fit(equations, S, options_.gate);
  if (most_refused(equations, RawKind::range)) {
    tally_.refused += equations.size;
    for (RangeShare& share : shares) share.share = 0;
    believe_again(epoch);
    return shares;
  }
  // Weighed by what is left of them, given all others and the motion, until weights and estimate agree.
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < equations.size; ++i) {
      RawEquation& e = equations.all.at(i);
      if (!e.used) continue;
      const double left = e.residual - e.spread.dot(information.mean);
      shares[i].share = share_of(left / std::sqrt(variances.at(i)));
      e.variance = factor * variances.at(i) / shares[i].share;
    }
    information = combined(equations);
  }
  for (std::size_t i = 0; i < equations.size; ++i) {
    const RawEquation& e = equations.all.at(i);
    if (!e.used) shares[i].share = 0;
    shares[i].residual = e.residual - e.spread.dot(information.mean);
    ++(!e.used ? tally_.refused : shares[i].share < 0.5 ? tally_.doubted : tally_.counted);
  }
  P_ -= C * information.gain * C.transpose();
  apply(C * information.mean);
  const auto counts = [](const RangeShare& share) { return share.share >= 0.5; };
  const auto counted = static_cast<std::size_t>(std::count_if(shares.begin(), shares.end(), counts));
  if (2 * counted >= shares.size()) {
    agreed_ = epoch.time;
  } else {
    believe_again(epoch);
  }
  return shares;
}

double PlanarFilter::update(const GnssFix& fix) {
  if (!started_ || !fix.position.allFinite() || !fix.covariance.allFinite()) return 0;
  if (last_epoch_ && fix.time <= *last_epoch_) {
    ++tally_.untimely;
    return 0;
  }
  const double factor = lasting(fix.time);
  const Vector3d residual = fix.position - position_;
  const Eigen::Matrix<double, kPlanarStates, 3> C = P_.leftCols<3>();
  const Matrix3d S = C.topRows<3>();
  const Matrix3d own = fix.covariance.inverse();
  double share = 1;
  Matrix3d inverse = Matrix3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    inverse = (S + factor / share * fix.covariance).inverse();
    const Vector3d left = residual - S * (inverse * residual);
    share = share_of(std::sqrt(left.dot(own * left) / 3));
  }
  inverse = (S + factor / share * fix.covariance).inverse();
  if (!inverse.allFinite()) return 0;
  P_ -= C * inverse * C.transpose();
  apply(C * (inverse * residual));
  return share;
}

PlanarEstimate PlanarFilter::estimate() const {
  PlanarEstimate now;
  now.time = time_;
  now.position = position_;
  now.covariance = P_.topLeftCorner<3, 3>();
  const Vector2d ahead = direction(turned_);
  now.yaw = std::atan2(ahead.y(), ahead.x());
  now.scale = heading_.norm();
  const Matrix2d spread = P_.block<2, 2>(kPlanarHeading, kPlanarHeading);
  const Vector2d along = now.scale > 0 ? Vector2d(heading_ / now.scale) : Vector2d(1, 0);
  const Vector2d across = quarter_turn() * along;
  now.scale_sigma = std::sqrt(along.dot(spread * along));
  now.yaw_sigma =
      std::min(std::numbers::pi, std::sqrt(across.dot(spread * across)) / std::max(1e-3, now.scale));
  now.yaw_known = scale_known_;
  now.speed = now.scale * speed_;
  now.yaw_rate_bias = bias_;
  now.clock = receiver_.clock;
  now.drift = receiver_.drift;
  return now;
}

}  // namespace pade::navigation
