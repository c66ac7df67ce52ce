// GNSS in the filter: the split of position errors, re-acquisition, and what contradictions lead to.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pade/navigation/filter.hpp"

namespace pade::navigation {
namespace {

constexpr int kLeastRejections = 3;  // in a row, before a sensor is believed against the filter
constexpr double kNoRuling = 3;      // s, for which positions are waited for to rule between the two
constexpr double kAgreement = 3;     // s, for which doubted velocities must fit to be used again
constexpr double kAgreementDrift = 12;
constexpr double kOfOneComponent = 0.75;  // of the bound, where one component can drift and not three
constexpr double kLearnable = 20;         // of the drift
constexpr double kTrusted = 10;           // s of agreement after which a contradiction is a change
constexpr double kRecent = 15;            // s
constexpr double kDoubtedSpeed = 1;       // m/s; doubted velocities may have led the filter astray by more
// Opened at a first alarm, twice as much at each further one.
constexpr double kOpenedTilt = 0.03;  // rad
constexpr double kOpenedRate = 0.02;  // rad/s
constexpr double kOpenedForce = 0.2;  // m/s²
constexpr int kMostDoublings = 3;
// A yaw is turned to what the velocities show if it is wrong by more than this.
constexpr double kLeastTurn = 0.2;        // rad
constexpr double kTurnSigmas = 4.5;       // and by more than so many
constexpr double kBentRate = 0.002;       // rad/s, of a bias that was to explain a wrong yaw
constexpr double kAzimuthAgreement = 10;  // s, for which a doubted magnetometer must fit to be used again

/// A covariance with each axis at or above the floor; nothing if it is not a covariance.
Matrix3d floored(const Matrix3d& covariance, double floor) {
  Matrix3d result = 0.5 * (covariance + covariance.transpose());
  for (int i = 0; i < 3; ++i) result(i, i) = std::max(result(i, i), floor * floor);
  return result;
}

bool used(const Innovation& innovation) {
  return innovation.verdict != Verdict::rejected && innovation.verdict != Verdict::unusable;
}

/// What a sensor shows while nothing is wrong.
bool usual(const Innovation& innovation, bool lost) {
  return innovation.verdict == Verdict::accepted && !lost;
}

/// What counts of an innovation: of one that is rejected alone less, for it may be an outlier.
Vector3d counted(const Innovation& innovation, int rejections_before) {
  constexpr double kAlone = 2.5;
  const double norm = innovation.white.norm();
  const bool alone = innovation.verdict == Verdict::rejected && rejections_before == 0 && norm > kAlone;
  return alone ? Vector3d(innovation.white * (kAlone / norm)) : innovation.white;
}

/// Whether the velocities that are being rejected are right, and the filter is wrong.
bool velocities_are_right(const FilterCore& core, const FilterOptions& options) {
  const Integrity& integrity = core.integrity;
  const Time now = core.state.time;
  if (integrity.velocity_doubted) return false;
  // What has drifted to the gate is the filter; velocities that are wrong are so at once.
  if (core.velocity_rejections <= 2 && integrity.velocity.drift() > options.drift_bound) return true;
  const double silence = seconds_between(core.velocity_accepted, now);
  if (silence < options.reacquire_after || core.velocity_rejections < kLeastRejections) return false;
  return !integrity.watching || integrity.velocity_refuses_wait || !integrity.dispute.can_rule(now) ||
         silence >= kNoRuling;
}

}  // namespace

Matrix3d Filter::split_position_noise(const GnssFix& fix) {
  const Matrix3d total = floored(fix.covariance, options_.position_sigma_floor);
  const double horizontal = std::sqrt(0.5 * (total(0, 0) + total(1, 1)));
  const bool carrier = horizontal < options_.carrier_phase_limit;
  const double share = carrier ? options_.carrier_phase_white_share : options_.single_point_white_share;
  const double tau =
      carrier ? options_.carrier_phase_correlation_time : options_.single_point_correlation_time;
  const Vector3d sigma = ((1 - share) * total.diagonal()).cwiseSqrt();

  GnssErrorClass& known = core_.gnss_class;
  if (known.correlation_time != tau) {  // another kind of solution has another, independent bias
    P_.middleCols<3>(kPositionBias).setZero();
    P_.middleRows<3>(kPositionBias).setZero();
    P_.diagonal().segment<3>(kPositionBias) = sigma.cwiseAbs2();
    core_.state.position_bias.setZero();
  } else {  // a receiver that announces a larger error has one now, not in two minutes
    const Vector3d grown = (sigma.cwiseAbs2() - known.bias_variance).cwiseMax(0);
    P_.diagonal().segment<3>(kPositionBias) += grown;
  }
  const bool same_kind = known.correlation_time == tau;
  known.bias_variance =
      same_kind ? Vector3d(sigma.cwiseAbs2().cwiseMax(known.bias_variance)) : sigma.cwiseAbs2();
  known.bias_sigma = sigma;
  known.correlation_time = tau;
  return share * total;
}

void Filter::shift_common_position(const Matrix3d& covariance) {
  // A common shift δ of the world moves every ρ by R^T δ and leaves all relative motion as it is.
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxState, 3> G = decltype(G)::Zero(size(), 3);
  G.middleRows<3>(kRho) = core_.state.X.R.toRotationMatrix().transpose();
  if (options_.raw_gnss) G.middleRows<3>(kAnchorPosition).setIdentity();
  if (options_.camera)
    G.middleRows<3>(camera_at() + kAnchorPose + 3) = core_.camera.anchor.matrix3().transpose();
  for (int i = 0; i < clones_; ++i) {
    G.middleRows<3>(clone_at(i) + 3) = clone_poses_[static_cast<std::size_t>(i)].matrix3().transpose();
  }
  P_ += G * covariance * G.transpose();
}

Innovation Filter::update(const GnssFix& fix) {
  if (!fix.position.allFinite() || !fix.covariance.allFinite()) return {};
  flush();
  Integrity& integrity = core_.integrity;
  const Time now = core_.state.time;
  const Matrix3d white = split_position_noise(fix);
  const Prediction<3> prediction = predict_gnss_position(core_.state, lever_arm_);
  const Vector3d residual = fix.position - prediction.value;
  hear_dispute(integrity.dispute.position(fix.position, std::sqrt(white.trace() / 3), now));
  compare_gnss(fix.position, white);
  const double gate = integrity.position_doubted ? 0 : options_.gate_probability_3;  // 0: nothing passes
  Innovation innovation = correct<3>(prediction, residual, white, gate);
  if (innovation.verdict == Verdict::rejected) {
    ++core_.position_rejections;
    const double silence = seconds_between(core_.position_accepted, now);
    if (!integrity.position_doubted && silence >= options_.reacquire_after &&
        core_.position_rejections >= kLeastRejections) {
      const Vector3d before = core_.state.X.p;
      shift_common_position(residual.cwiseAbs2().asDiagonal());
      innovation = correct<3>(prediction, residual, white, options_.gate_probability_3, true);
      innovation.verdict = Verdict::reacquired;
      innovation.jump = (core_.state.X.p - before).norm();
      integrity.agreement.jumped(residual, now);
    }
  }
  if (used(innovation)) {
    core_.position_accepted = now;
    core_.position_rejections = 0;
  }
  judge_position(innovation);
  return innovation;
}

Innovation Filter::believe_velocity(const Prediction<3>& prediction, const Vector3d& residual,
                                    const Matrix3d& noise) {
  const Vector3d before = core_.state.X.v;
  P_.diagonal().segment<3>(kNu).array() += residual.squaredNorm();
  Innovation innovation = correct<3>(prediction, residual, noise, options_.gate_probability_3, true);
  innovation.verdict = Verdict::reacquired;
  innovation.jump = (core_.state.X.v - before).norm();
  return innovation;
}

Innovation Filter::update(const GnssVelocity& velocity) {
  if (!velocity.velocity.allFinite() || !velocity.covariance.allFinite()) return {};
  flush();
  Integrity& integrity = core_.integrity;
  const Time now = core_.state.time;
  const Matrix3d noise = floored(velocity.covariance, options_.velocity_sigma_floor);
  Prediction<3> prediction = predict_gnss_velocity(core_.state, lever_arm_);
  Vector3d residual = velocity.velocity - prediction.value;
  // No innovation passes a gate of zero.
  const double gate = integrity.velocity_doubted ? 0 : options_.gate_probability_3;
  if (check_yaw(velocity, prediction)) {
    prediction = predict_gnss_velocity(core_.state, lever_arm_);
    residual = velocity.velocity - prediction.value;
    P_.diagonal().segment<3>(kNu).array() += residual.squaredNorm();
  }
  Innovation innovation = correct<3>(prediction, residual, noise, gate);
  if (integrity.watching && innovation.verdict != Verdict::unusable) {
    integrity.velocity.add(counted(innovation, core_.velocity_rejections), now,
                           usual(innovation, integrity.lost));
  }
  if (innovation.verdict == Verdict::rejected) {
    ++core_.velocity_rejections;
    if (velocities_are_right(core_, options_)) {
      if (integrity.watching && core_.velocity_seen) open_inertial();
      innovation = believe_velocity(prediction, residual, noise);
    }
  }
  const Vector3d axes = measured_axes(velocity);
  // Of what is not measured there is no dispute.
  const Vector3d heard = (axes.array() > 0).select(velocity.velocity, prediction.value);
  integrity.agreement.velocity(velocity.velocity, axes, now);
  integrity.dispute.velocity(heard, prediction.value, now, !used(innovation));
  if (used(innovation)) {
    core_.velocity_accepted = now;
    core_.velocity_seen = true;
    core_.velocity_rejections = 0;
    integrity.velocity_refuses_wait = false;
  }
  judge_velocity(innovation);
  return innovation;
}

void Filter::hear_dispute(Dispute::Ruling ruling) {
  if (ruling == Dispute::Ruling::velocity_wrong) doubt_velocity();
  if (ruling == Dispute::Ruling::filter_wrong) core_.integrity.velocity_refuses_wait = true;
}

void Filter::compare_gnss(const Vector3d& position, const Matrix3d& white) {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching) return;
  const Time now = core_.state.time;
  const GnssErrorClass& kind = core_.gnss_class;
  GnssAgreement& agreement = integrity.agreement;
  agreement.position(position, white.diagonal().cwiseSqrt(),
                     std::sqrt(2 / kind.correlation_time) * kind.bias_sigma, now);
  const double agreed = agreement.agreed(now);
  integrity.ever_agreed = integrity.ever_agreed || agreed > kTrusted;
  if (agreed > kAgreement || !agreement.hears_velocities(now)) integrity.position_doubted = false;
  if (!agreement.contradicts()) return;
  integrity.raise(now);
  if (integrity.velocity_doubted || integrity.position_doubted) return;
  // The inertial sensors have seen which of the two parted from them; those that never agreed have shown
  // nothing, and then the positions are believed.
  const bool velocity_parted = seconds_between(integrity.last_opening, now) < kRecent;
  if (!integrity.ever_agreed || velocity_parted) {
    // They have led the filter astray, by as much as their own size.
    const double speed = std::max(kDoubtedSpeed, core_.state.X.v.norm());
    open_inertial();
    P_.diagonal().segment<3>(kNu).array() += speed * speed;
    doubt_velocity();
  } else {
    integrity.position_doubted = true;
  }
}

void Filter::doubt_velocity() {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching || integrity.velocity_doubted) return;
  integrity.velocity_doubted = true;
  ++integrity.times_doubted;
  integrity.velocity.forget();
  integrity.velocity_agrees_since = core_.state.time;
  integrity.raise(core_.state.time);
}

void Filter::judge_velocity(const Innovation& innovation) {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching || innovation.verdict == Verdict::unusable) return;
  const Time now = core_.state.time;
  if (integrity.velocity_doubted) {
    const bool agrees = !integrity.agreement.contradicts() &&
                        innovation.chi_square < options_.gate_probability_3 &&
                        integrity.velocity.drift() < kAgreementDrift;
    if (!agrees) integrity.velocity_agrees_since = now;
    if (seconds_between(integrity.velocity_agrees_since, now) > kAgreement ||
        !integrity.dispute.can_rule(now)) {
      integrity.velocity_doubted = false;
      integrity.velocity.forget();
    }
  } else if (used(innovation) && integrity.velocity.drift() > options_.drift_bound) {
    open_inertial();
  }
  integrity.settle(now);
}

void Filter::judge_position(const Innovation& innovation) {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching || innovation.verdict == Verdict::unusable) return;
  const Time now = core_.state.time;
  if (integrity.position_doubted) return integrity.settle(now);
  integrity.position.add(counted(innovation, core_.position_rejections - 1), now,
                         usual(innovation, integrity.lost));
  if (integrity.position.drift() > options_.drift_bound) integrity.raise(now);
  integrity.settle(now);
}

void Filter::judge_azimuth(InnovationWindow& window, const Innovation& innovation) {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching || innovation.verdict == Verdict::unusable) return;
  const Time now = core_.state.time;
  // A slow drift of the yaw must not be learnt as usual before it is noticed.
  window.add(innovation.white, now, usual(innovation, integrity.lost) && window.drift() < kLearnable);
  if (window.drift() > kOfOneComponent * options_.drift_bound) {
    const bool is_magnetometer = &window == &integrity.magnetometer;
    if (is_magnetometer && velocities_deny(innovation.residual.x())) return doubt_magnetometer();
    // What the yaw did to the horizon in the meantime is not known either.
    const Integrity before = integrity;
    open_inertial();
    // A magnetometer near iron must not make the filter give itself up.
    integrity.last_opening = before.last_opening;
    integrity.openings = std::max(before.openings, std::min(integrity.openings, 2));
    open_common_yaw(innovation.residual.x());
    window.forget();
  }
  integrity.settle(now);
}

/// Velocities and inertial sensors know the yaw where the vehicle changes its velocity, and need no compass.
/// @param turn   that the magnetometer asks for if the vehicle has no iron, rad
/// @param sigma  of it, by the magnetometer's noise and the iron that a vehicle may have, rad
void Filter::judge_magnetometer(const Innovation& innovation, double turn, double sigma) {
  Integrity& integrity = core_.integrity;
  if (!integrity.watching || innovation.verdict == Verdict::unusable) return;
  const Time now = core_.state.time;
  if (integrity.magnetometer_doubted) {
    if (innovation.chi_square > options_.gate_probability_1) integrity.magnetometer_agrees_since = now;
    if (seconds_between(integrity.magnetometer_agrees_since, now) < kAzimuthAgreement) return;
    integrity.magnetometer_doubted = false;
    integrity.magnetometer.forget();
    return;
  }
  const YawWitness& yaw = integrity.yaw;
  if (!integrity.velocity_doubted && !integrity.position_doubted && yaw.is_clear()) {
    const double apart = std::abs(std::remainder(turn - yaw.error(), 2 * std::numbers::pi));
    if (apart > std::max(kLeastTurn, kTurnSigmas * std::hypot(sigma, yaw.sigma()))) {
      doubt_magnetometer();
      return turn_to_velocities();
    }
  }
  judge_azimuth(integrity.magnetometer, innovation);
}

/// Whether the yaw is right by them, rather than wrong by `turn`.
bool Filter::velocities_deny(double turn) const {
  const YawWitness& yaw = core_.integrity.yaw;
  return !core_.integrity.velocity_doubted && !core_.integrity.position_doubted && yaw.is_clear() &&
         yaw.sigma() < 0.5 * std::abs(turn) && std::abs(yaw.error()) < std::abs(yaw.error() - turn);
}

void Filter::doubt_magnetometer() {
  Integrity& integrity = core_.integrity;
  integrity.magnetometer_doubted = true;
  ++integrity.times_magnetometer_doubted;
  integrity.magnetometer.forget();
  integrity.magnetometer_agrees_since = core_.state.time;
  // What was taken for the vehicle's iron.
  core_.state.iron.setZero();
  P_.middleCols<3>(kIron).setZero();
  P_.middleRows<3>(kIron).setZero();
  P_.diagonal().segment<3>(kIron).setConstant(options_.iron_sigma * options_.iron_sigma);
}

/// A yaw that is far from what velocities and inertial sensors show is turned to it. @return whether it was
bool Filter::check_yaw(const GnssVelocity& velocity, const Prediction<3>& prediction) {
  Integrity& integrity = core_.integrity;
  YawWitness& yaw = integrity.yaw;
  const Vector3d axes = measured_axes(velocity);
  if (axes.head<2>().minCoeff() <= 0 || integrity.velocity_doubted) return false;
  const Vector3d of_body = velocity.velocity - (prediction.value - core_.state.X.v);
  yaw.velocity(of_body, std::sqrt(0.5 * velocity.covariance.diagonal().head<2>().sum()), core_.state.time);
  if (!integrity.watching || integrity.position_doubted || !yaw.is_clear()) return false;
  const Vector3d up = core_.state.X.R.conjugate() * Vector3d::UnitZ();
  const double believed = up.dot(P_.block<3, 3>(kPhi, kPhi) * up);
  const double error = std::abs(yaw.error());
  if (error < std::max(kLeastTurn, kTurnSigmas * yaw.sigma()) || error < kTurnSigmas * std::sqrt(believed))
    return false;
  if (!integrity.magnetometer.empty() && !integrity.magnetometer_doubted) doubt_magnetometer();
  turn_to_velocities();
  return true;
}

/// A yaw that is wrong has been wrong: what turns the present pose turns those that are remembered, and
/// leaves the motion between them without a turn.
void Filter::open_common_yaw(double sigma) {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1> turn = decltype(turn)::Zero(size());
  turn.segment<3>(kPhi) = core_.state.X.R.conjugate() * Vector3d::UnitZ();
  if (options_.camera)
    turn.segment<3>(camera_at() + kAnchorPose) = core_.camera.anchor.rotation.conjugate() * Vector3d::UnitZ();
  for (int i = 0; i < clones_; ++i) {
    const Pose& pose = clone_poses_[static_cast<std::size_t>(i)];
    turn.segment<3>(clone_at(i)) = pose.rotation.conjugate() * Vector3d::UnitZ();
  }
  P_ += sigma * sigma * turn * turn.transpose();
}

void Filter::turn_to_velocities() {
  const double error = core_.integrity.yaw.error();
  const double sigma = core_.integrity.yaw.sigma();
  core_.integrity.raise(core_.state.time);
  core_.integrity.velocity.forget();
  const Vector3d up = core_.state.X.R.conjugate() * Vector3d::UnitZ();
  open_common_yaw(error);
  P_.block<3, 3>(kGyroscopeBias, kGyroscopeBias) += kBentRate * kBentRate * up * up.transpose();
  Prediction<1> about_vertical;
  about_vertical.H.setZero();
  about_vertical.H.segment<3>(kPhi) = up.transpose();
  correct<1>(about_vertical, Eigen::Matrix<double, 1, 1>(error), Eigen::Matrix<double, 1, 1>(sigma * sigma),
             options_.gate_probability_1, true);
}

void Filter::open_inertial() {
  core_.integrity.raise(core_.state.time);
  core_.integrity.last_opening = core_.state.time;
  const double scale = std::exp2(std::min(core_.integrity.openings++, kMostDoublings));
  const auto open = [&](int first, double sigma) {
    P_.diagonal().segment<3>(first).array() += scale * scale * sigma * sigma;
  };
  open(kPhi, kOpenedTilt);
  open(kGyroscopeBias, kOpenedRate);
  open(kAccelerometerBias, kOpenedForce);
  core_.integrity.velocity.forget();
}

}  // namespace pade::navigation
