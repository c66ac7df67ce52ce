// Raw GNSS in the filter: the receiver's clock, each satellite's range, rate and phase, and the anchor from
// which phases are counted (docs/navigation.md, section 7).
#include <algorithm>
#include <cmath>
#include <span>

#include "pade/navigation/filter.hpp"
#include "pade/navigation/tight/raw_median.hpp"

namespace pade::navigation {
namespace {

constexpr double kFirstClockSigma = 30;  // of a clock taken from a median of ranges, m
constexpr double kFirstDriftSigma = 3;   // likewise, m/s
constexpr double kUnknownDrift = 300;    // of an oscillator: 1e-6, m/s
constexpr double kVerticalBias = 1.6;    // of the common bias, against the horizontal one
constexpr std::size_t kLeastForFix = 4;
// Doppler comes of the loop that follows the phase: beside a phase it is not news of its own, and counts
// less.
constexpr double kBesidePhase = 3;
constexpr int kLeastContradictions = 3;  // in a row, before the satellites are believed against the filter

/// Whether the bias of the satellite's system is known.
bool is_known(const RawState& raw, const RawSatellite& satellite) {
  const auto system = static_cast<std::size_t>(satellite.satellite.system);
  return system == 0 || raw.system_known.at(system - 1);
}

/// What tells of the velocity: rates, or phases where the receiver gives no Doppler.
RawKind judges_of(const RawEquations& equations) {
  return equations.count(RawKind::rate, false) > 0 ? RawKind::rate : RawKind::phase;
}

/// The mean velocity since the anchor that the phases show, beside what all have in common, against the
/// filter's: what a receiver without Doppler has in place of velocity_innovation(). Empty without 5 phases.
/// @param S    covariance of the variables
/// @param age  of the anchor, s
Innovation innovation_of_phases(const RawEquations& equations, const RawMatrix& S, double age) {
  const bool all = most_refused(equations, RawKind::phase);
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  Eigen::Matrix<double, 4, kRawVariables> of_variables = decltype(of_variables)::Zero();
  int count = 0;
  for (const RawEquation& e : equations) {
    if (e.kind != RawKind::phase || !(e.used || all)) continue;
    Eigen::Vector4d g;
    g << e.row.segment<3>(kOfPosition), 1;
    g /= e.variance;
    N += e.variance * g * g.transpose();
    b += g * e.residual;
    of_variables += g * e.row.transpose();
    ++count;
  }
  if (count < 5 || age < 1e-3) return {};
  const Eigen::LDLT<Eigen::Matrix4d> factor(N);
  const Eigen::Matrix4d inverse = factor.solve(Eigen::Matrix4d::Identity());
  const Eigen::Matrix<double, 4, kRawVariables> T = inverse * of_variables;
  const Eigen::Matrix4d covariance = inverse + T * S * T.transpose();
  Innovation innovation;
  innovation.size = 3;
  innovation.residual = (inverse * b).head<3>() / age;
  const Matrix3d C = covariance.topLeftCorner<3, 3>() / (age * age);
  innovation.sigma = C.diagonal().cwiseSqrt();
  const Eigen::LLT<Matrix3d> root(C);
  if (root.info() != Eigen::Success || !innovation.residual.allFinite()) return {};
  innovation.white = root.matrixL().solve(innovation.residual);
  innovation.chi_square = innovation.white.squaredNorm();
  return innovation;
}

/// Whether the rates, or what is in their place, have been refused for so long that the filter is wrong.
bool motion_is_refused(const RawState& raw, Time now, const FilterOptions& options) {
  return raw.contradictions >= kLeastContradictions &&
         seconds_between(raw.rates_agreed, now) >= options.reacquire_after;
}

/// Whether no range of GPS has been used since the clock was begun by another system: clock and biases are
/// then known as sums alone, each by itself is as it began.
template <class Matrix>
bool is_without_gps(const RawState& raw, const Matrix& P) {
  const double unknown = kFirstClockSigma * kFirstClockSigma / 6;  // of three systems a quarter is left
  bool any = false;
  for (int system = 1; system < static_cast<int>(gnss::kSystems); ++system) {
    if (!raw.system_known.at(static_cast<std::size_t>(system) - 1)) continue;
    const int bias = kSystemBias + system - 1;
    const double together = P(kClock, kClock) * P(bias, bias);
    if (P(bias, bias) < unknown || P(kClock, bias) > -0.5 * std::sqrt(together)) return false;
    any = true;
  }
  return any && P(kClock, kClock) > unknown;
}

/// Where the satellite's phase stands among those at the anchor; `anchored` if nowhere.
std::size_t place_of(const RawState& raw, const RawSatellite& satellite) {
  for (std::size_t i = 0; i < raw.anchored; ++i) {
    if (raw.phases.at(i).satellite == satellite.satellite) return i;
  }
  return raw.anchored;
}

/// Whether its phase can be counted from the anchor.
bool goes_on(const AnchoredPhase& anchor, const RawSatellite& satellite) {
  return anchor.goes_on && satellite.phase && !satellite.lost_lock &&
         anchor.half_cycle == satellite.half_cycle && anchor.code == satellite.code;
}

/// Counts what was used, and says which satellites were not.
void count(const RawEquations& equations, RawTally& tally, Innovation& innovation) {
  for (const RawEquation& e : equations) {
    RawCounts& counts = e.kind == RawKind::range  ? tally.ranges
                        : e.kind == RawKind::rate ? tally.rates
                                                  : tally.phases;
    ++(e.used ? counts.used : counts.refused);
    const std::uint64_t bit = e.used ? 0 : std::uint64_t{1} << e.satellite;
    if (e.kind == RawKind::range) innovation.refused_ranges |= bit;
    if (e.kind == RawKind::phase) innovation.refused_phases |= bit;
  }
}

}  // namespace

void Filter::flush_receiver(double T) {
  core_.raw.receiver.clock += T * core_.raw.receiver.drift;
  P_.row(kClock) += T * P_.row(kDrift);
  P_.col(kClock) += T * P_.col(kDrift);
  const double noise = options_.clock_noise * options_.clock_noise;
  const double walk = options_.clock_drift_walk * options_.clock_drift_walk;
  P_(kClock, kClock) += noise * T + walk * T * T * T / 3;
  P_(kClock, kDrift) += walk * T * T / 2;
  P_(kDrift, kClock) += walk * T * T / 2;
  P_(kDrift, kDrift) += walk * T;
}

RawVariables Filter::raw_variables() const {
  const NavigationState& state = core_.state;
  RawVariables x;
  x.position = state.X.p + state.X.R * lever_arm_;
  x.velocity = state.X.v + state.X.R * state.angular_rate.cross(lever_arm_);
  x.position_bias = state.position_bias;
  x.receiver = core_.raw.receiver;
  return x;
}

Eigen::Matrix<double, 6, kBase> Filter::antenna_rows() const {
  Eigen::Matrix<double, 6, kBase> H;
  H.topRows<3>() = predict_gnss_position(core_.state, lever_arm_).H;
  H.topRows<3>().middleCols<3>(kPositionBias).setZero();
  H.bottomRows<3>() = predict_gnss_velocity(core_.state, lever_arm_).H;
  return H;
}

void Filter::set_prior(int index, double variance) {
  P_.row(index).setZero();
  P_.col(index).setZero();
  P_(index, index) = variance;
}

void Filter::start_receiver(const RawEpoch& epoch) {
  RawState& raw = core_.raw;
  const RawVariables x = raw_variables();
  if (raw.clock_known && is_without_gps(raw, P_)) {
    // The clock took the bias of the system that began it for none. If GPS is there now, what the clock is
    // ahead of its time, and what the others are behind, are both wrong by the same.
    Median ranges;
    for (const RawSatellite& s : satellites_of(epoch)) {
      if (s.range && s.satellite.system == gnss::System::gps)
        ranges.add(*s.range - predict_range(x, s).value);
    }
    if (ranges.count() > 0) {
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxState, 1> G = decltype(G)::Zero(size());
      G[kClock] = G[kAnchorClock] = 1;
      raw.receiver.clock += ranges.value();
      raw.receiver.anchor_clock += ranges.value();
      for (int system = 1; system < static_cast<int>(gnss::kSystems); ++system) {
        if (!raw.system_known.at(static_cast<std::size_t>(system) - 1)) continue;
        G[kSystemBias + system - 1] = -1;
        raw.receiver.system_bias[system - 1] -= ranges.value();
      }
      P_.noalias() += kFirstClockSigma * kFirstClockSigma * G * G.transpose();
    }
  }
  if (!raw.clock_known) {
    std::array<Median, gnss::kSystems> ranges;
    Median rates;
    for (const RawSatellite& s : satellites_of(epoch)) {
      if (s.range) {
        ranges.at(static_cast<std::size_t>(s.satellite.system)).add(*s.range - predict_range(x, s).value);
      }
      if (s.rate) rates.add(*s.rate - predict_rate(x, s).value);
    }
    const auto first =
        std::find_if(ranges.begin(), ranges.end(), [](const Median& m) { return m.count() > 0; });
    if (first == ranges.end()) return;
    const bool has_rates = rates.count() > 0;  // not every receiver writes Doppler
    raw.clock_known = true;
    raw.receiver.clock += first->value();
    if (has_rates) raw.receiver.drift += rates.value();
    raw.rates_agreed = raw.ranges_agreed = core_.state.time;
    set_prior(kClock, kFirstClockSigma * kFirstClockSigma);
    const double drift = has_rates ? kFirstDriftSigma : kUnknownDrift;
    set_prior(kDrift, drift * drift);
    const Vector3d sigma = options_.raw_bias_sigma * Vector3d(1, 1, kVerticalBias);
    core_.gnss_class = {sigma, options_.single_point_correlation_time, sigma.cwiseAbs2()};
  }
  for (std::size_t system = 1; system < gnss::kSystems; ++system) {
    if (raw.system_known.at(system - 1)) continue;
    Median ranges;
    const RawVariables now = raw_variables();
    for (const RawSatellite& s : satellites_of(epoch)) {
      if (s.range && static_cast<std::size_t>(s.satellite.system) == system) {
        ranges.add(*s.range - predict_range(now, s).value);
      }
    }
    if (ranges.count() == 0) continue;
    raw.system_known.at(system - 1) = true;
    raw.receiver.system_bias[static_cast<int>(system) - 1] += ranges.value();
    set_prior(kSystemBias + static_cast<int>(system) - 1, kFirstClockSigma * kFirstClockSigma);
  }
}

void Filter::follow_clock_jump(const RawEpoch& epoch) {
  RawState& raw = core_.raw;
  const auto common_of = [&](bool phases) {
    const RawVariables x = raw_variables();
    Median residuals;
    for (const RawSatellite& s : satellites_of(epoch)) {
      if (!phases && s.range && is_known(raw, s)) residuals.add(*s.range - predict_range(x, s).value);
      const std::size_t at = phases ? place_of(raw, s) : raw.anchored;
      if (at < raw.anchored && goes_on(raw.phases.at(at), s)) {
        residuals.add(*s.phase - raw.phases.at(at).phase -
                      predict_phase_change(x, s, raw.phases.at(at)).value);
      }
    }
    return jump_of(residuals);
  };
  const double jump = common_of(false);
  raw.receiver.clock += jump;
  if (jump != 0) ++raw.tally.clock_jumps;
  // There are receivers whose phases jump with their ranges, and others whose do not.
  raw.receiver.anchor_clock -= common_of(true);
}

void Filter::collect(const RawEpoch& epoch, RawEquations& equations) const {
  const RawState& raw = core_.raw;
  const RawVariables x = raw_variables();
  std::size_t satellite = 0;
  const auto add = [&](RawKind kind, double measured, double variance, const RawPrediction& predicted) {
    RawEquation& e = equations.add();
    e.kind = kind;
    e.satellite = satellite;
    e.residual = measured - predicted.value;
    e.variance = variance;
    e.row = predicted.row;
    e.used = true;
    return &e;
  };
  for (const RawSatellite& s : satellites_of(epoch)) {
    const std::size_t at = place_of(raw, s);
    const bool has_phase = at < raw.anchored && goes_on(raw.phases.at(at), s);
    const double rate_sigma = (has_phase ? kBesidePhase : 1) * s.rate_sigma;
    if (s.rate) add(RawKind::rate, *s.rate, rate_sigma * rate_sigma, predict_rate(x, s));
    if (has_phase) {
      const AnchoredPhase& anchor = raw.phases.at(at);
      add(RawKind::phase, *s.phase - anchor.phase,
          s.phase_sigma * s.phase_sigma + anchor.sigma * anchor.sigma, predict_phase_change(x, s, anchor))
          ->anchored = at;
    }
    if (s.range && is_known(raw, s)) {
      add(RawKind::range, *s.range, s.range_sigma * s.range_sigma, predict_range(x, s));
    }
    ++satellite;
  }
}

void Filter::take(const RawInformation& information, const TallMatrix& C) {
  const TallMatrix gained = C * information.gain;
  P_.noalias() -= gained * C.transpose();
  const auto n = P_.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) P_(i, j) = P_(j, i) = 0.5 * (P_(i, j) + P_(j, i));
  }
  apply(C * information.mean);
}

void Filter::set_anchor(const RawEpoch& epoch) {
  RawState& raw = core_.raw;
  const RawVariables x = raw_variables();
  raw.anchor_time = core_.state.time;
  raw.anchored = 0;
  for (const RawSatellite& s : satellites_of(epoch)) {
    if (!s.phase) continue;
    raw.phases.at(raw.anchored++) = {s.satellite,   s.code,       s.position, *s.phase,
                                     s.phase_sigma, s.half_cycle, true};
  }
  raw.receiver.anchor_position = x.sampled_at();
  raw.receiver.anchor_clock = x.receiver.clock;
  const Eigen::Matrix<double, 6, kBase> H = antenna_rows();
  const Eigen::Matrix<double, 3, kBase> G =
      H.topRows<3>() - x.receiver.clock / gnss::kSpeedOfLight * H.bottomRows<3>();
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, kMaxState, 4> copied(size(), 4);
  copied.leftCols<3>() = P_.leftCols<kBase>() * G.transpose();
  copied.col(3) = P_.col(kClock);
  Eigen::Matrix4d own;
  own.topRows<3>() = G * copied.topRows<kBase>();
  own.row(3) = copied.row(kClock);
  P_.middleCols<4>(kAnchorPosition) = copied;
  P_.middleRows<4>(kAnchorPosition) = copied.transpose();
  P_.block<4, 4>(kAnchorPosition, kAnchorPosition) = 0.5 * (own + own.transpose());
}

void Filter::follow_phases(const RawEpoch& epoch, const RawEquations& equations) {
  RawState& raw = core_.raw;
  std::array<bool, kMostSatellites> held{};
  for (const RawEquation& e : equations) {
    if (e.kind == RawKind::phase && e.used) held.at(e.anchored) = true;
  }
  std::size_t going = 0;
  for (std::size_t i = 0; i < raw.anchored; ++i) {
    raw.phases.at(i).goes_on = held.at(i);
    going += held.at(i) ? 1 : 0;
  }
  const double age = seconds_between(raw.anchor_time, core_.state.time);
  if (2 * going <= raw.anchored || age > options_.phase_anchor_time - 1e-3) set_anchor(epoch);
}

Innovation Filter::velocity_innovation(const GnssVelocity& velocity) const {
  const Prediction<3> prediction = predict_gnss_velocity(core_.state, lever_arm_);
  Innovation innovation;
  innovation.size = 3;
  innovation.residual = velocity.velocity - prediction.value;
  const Matrix3d S =
      prediction.H * P_.topLeftCorner<kBase, kBase>() * prediction.H.transpose() + velocity.covariance;
  innovation.sigma = S.diagonal().cwiseSqrt();
  const Eigen::LLT<Matrix3d> factor(S);
  if (factor.info() != Eigen::Success || !innovation.residual.allFinite()) return {};
  innovation.white = factor.matrixL().solve(innovation.residual);
  innovation.chi_square = innovation.white.squaredNorm();
  return innovation;
}

bool Filter::ranges_fit(RawEquations& equations) {
  RawState& raw = core_.raw;
  const Time now = core_.state.time;
  if (!most_refused(equations, RawKind::range)) {
    if (equations.count(RawKind::range, true) < kLeastForFix) return true;
    raw.ranges_agreed = core_.position_accepted = now;
    return true;
  }
  for (RawEquation& e : equations) e.used = e.used && e.kind != RawKind::range;
  return false;
}

bool Filter::rates_fit(const RawEquations& equations) {
  RawState& raw = core_.raw;
  const RawKind judges = judges_of(equations);
  if (most_refused(equations, judges)) {
    ++raw.contradictions;
    return false;
  }
  raw.contradictions = 0;
  if (equations.count(judges, true) >= kLeastForFix) {
    raw.rates_agreed = core_.velocity_accepted = core_.state.time;
    core_.velocity_seen = true;
  }
  return true;
}

void Filter::judge_raw(const RawEpoch& epoch, const Innovation& innovation) {
  Integrity& integrity = core_.integrity;
  RawState& raw = core_.raw;
  const Time now = core_.state.time;
  if (innovation.size > 0) {
    integrity.velocity.add(innovation.white, now, innovation.verdict == Verdict::accepted && !integrity.lost);
    const bool refused = motion_is_refused(raw, now, options_);
    if (refused || integrity.velocity.drift() > options_.drift_bound) {
      open_inertial();
      if (refused) {
        P_.diagonal().segment<3>(kNu).array() += innovation.residual.squaredNorm();
        P_(kDrift, kDrift) += kFirstDriftSigma * kFirstDriftSigma;
      }
    }
  }
  if (seconds_between(raw.ranges_agreed, now) >= options_.reacquire_after && epoch.fix &&
      epoch.fix->position.allFinite()) {
    raw.ranges_agreed = now;
    const RawVariables x = raw_variables();
    const Vector3d apart = epoch.fix->position - x.position - x.position_bias;
    shift_common_position(apart.cwiseAbs2().asDiagonal());
    raw.clock_known = false;  // and is found anew, as are the biases of the systems
    raw.system_known.fill(false);
  }
  integrity.settle(now);
}

Innovation Filter::update(const RawEpoch& epoch) {
  Innovation innovation;
  if (!options_.raw_gnss || !core_.integrity.watching) {
    if (epoch.velocity) innovation = update(*epoch.velocity);
    if (epoch.fix) {
      const Innovation position = update(*epoch.fix);
      if (!epoch.velocity) innovation = position;
    }
    return innovation;
  }
  flush();
  start_receiver(epoch);
  if (!core_.raw.clock_known) return innovation;
  follow_clock_jump(epoch);
  if (epoch.velocity) innovation = velocity_innovation(*epoch.velocity);
  RawEquations equations;
  collect(epoch, equations);
  TallMatrix C(size(), kRawVariables);
  const Eigen::Matrix<double, 6, kBase> H = antenna_rows();
  C.leftCols<6>() = P_.leftCols<kBase>() * H.transpose();
  C.middleCols<3>(kOfBias) = P_.middleCols<3>(kPositionBias);
  C.middleCols<kRawStates>(kOfReceiver) = P_.middleCols<kRawStates>(kBase);
  RawMatrix S;
  S.topRows<6>() = H * C.topRows<kBase>();
  S.middleRows<3>(kOfBias) = C.middleRows<3>(kPositionBias);
  S.middleRows<kRawStates>(kOfReceiver) = C.middleRows<kRawStates>(kBase);
  RawInformation information = fit(equations, S, options_.raw_gate);
  if (equations.count(RawKind::rate, false) == 0) {
    const double age = seconds_between(core_.raw.anchor_time, core_.state.time);
    innovation = innovation_of_phases(equations, S, age);
  }
  const bool rates_agree = rates_fit(equations);
  if (!ranges_fit(equations)) information = combined(equations);
  if (rates_agree) {
    take(information, C);
  } else {
    for (RawEquation& e : equations) e.used = false;
  }
  count(equations, core_.raw.tally, innovation);
  innovation.verdict = rates_agree ? Verdict::accepted : Verdict::rejected;
  follow_phases(epoch, equations);
  judge_raw(epoch, innovation);
  return innovation;
}

}  // namespace pade::navigation
