// Position, velocity and steps from made-up measurements, and what spoils them.
#include <gtest/gtest.h>

#include "pade/navigation/gnss/least_squares.hpp"

#include "constellation.hpp"
#include "navigation/numeric_jacobian.hpp"

namespace pade::gnss {
namespace {

using Eigen::Vector3d;

SatelliteView* view_of(EpochResult& result, SatelliteId id) {
  for (SatelliteView& view : result.satellites) {
    if (view.satellite == id) return &view;
  }
  return nullptr;
}

struct Flight {
  BroadcastData data = sky();
  Receiver receiver{curve()};
  RawLog log;

  Flight() {
    log.broadcast = data;
    for (int i = 0; i < 8; ++i) log.epochs.push_back(observe(data, receiver, i));
  }
  Signal& signal(std::size_t epoch, SatelliteId id) {
    for (Signal& s : log.epochs.at(epoch).signals) {
      if (s.satellite == id) return s;
    }
    ADD_FAILURE() << to_string(id) << " is not in view";
    return log.epochs.at(epoch).signals.front();
  }
  /// One that stands high.
  SatelliteId high() {
    RawRun run = run_raw(log, {});
    for (const SatelliteView& view : run.epochs.front().satellites) {
      if (view.use == Use::used && view.direction.elevation > 0.7) return view.satellite;
    }
    ADD_FAILURE() << "no satellite stands high";
    return {};
  }
};

/// Errors of position, velocity and step of each epoch.
void expect_truth(const RawRun& run, const Receiver& receiver, double position, double velocity,
                  double step) {
  ASSERT_FALSE(run.epochs.empty());
  for (std::size_t i = 0; i < run.epochs.size(); ++i) {
    const EpochResult& e = run.epochs[i];
    const double t = static_cast<double>(i);
    ASSERT_TRUE(e.position) << i;
    EXPECT_LT((e.position->position - receiver.path(t)).norm(), position) << i;
    ASSERT_TRUE(e.velocity) << i;
    const Vector3d truth = (receiver.path(t + 0.01) - receiver.path(t - 0.01)) / 0.02;
    EXPECT_LT((e.velocity->velocity - truth).norm(), velocity) << i;
    EXPECT_NEAR(e.velocity->clock_rate, kSpeedOfLight * receiver.clock_rate, 0.01) << i;
    ASSERT_EQ(e.step.has_value(), i > 0) << i;
    if (!e.step) continue;
    EXPECT_LT((e.step->step - (receiver.path(t) - receiver.path(t - 1))).norm(), step) << i;
  }
}

/// Nearly normal numbers of variance 1.
struct Normal {
  std::uint64_t state = 1;
  double operator()() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      sum += static_cast<double>(state >> 11U) * 0x1p-53;
    }
    return sum;
  }
};

TEST(Positioning, FindsWhatTheReceiverDid) {
  const Flight flight;
  const RawRun run = run_raw(flight.log, {});
  EXPECT_GE(run.epochs.front().position->used, 15);
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);  // the Doppler of the model is a mean over 0.1 s
  const auto& clock = run.epochs.front().position->clock;
  EXPECT_NEAR(*clock[0], kSpeedOfLight * flight.receiver.clock, 0.01);
  EXPECT_NEAR(*clock[2] - *clock[0], kSpeedOfLight * flight.receiver.offset[2], 0.01);
  EXPECT_FALSE(clock[1]);
  EXPECT_LT(run.epochs.front().position->chi_square, 1e-3);
}

TEST(Positioning, WorksAnywhereOnTheEarth) {
  for (const double latitude : {-1.5, -0.7, 0.0, 0.8, 1.56}) {
    for (const double longitude : {-3.1, -1.0, 0.0, 2.0}) {
      const Vector3d place = ecef_of({latitude, longitude, 100});
      Receiver receiver{[&](double) { return place; }};
      RawLog log;
      log.broadcast = sky();
      log.epochs.push_back(observe(log.broadcast, receiver, 0));
      const RawRun run = run_raw(log, {});
      ASSERT_TRUE(run.epochs.front().position) << latitude << " " << longitude;
      EXPECT_LT((run.epochs.front().position->position - place).norm(), 2e-3);
    }
  }
}

TEST(Positioning, ErrorsAreAsLargeAsTheCovarianceSays) {
  Flight flight;
  Normal noise;
  PositioningOptions options;
  RawLog clean = flight.log;
  clean.epochs.resize(1);
  const Epoch epoch = clean.epochs.front();
  const RawRun exact = run_raw(clean, options);
  double nees = 0, chi_square = 0, redundancy = 0;
  constexpr int kDraws = 300;
  for (int draw = 0; draw < kDraws; ++draw) {
    auto& signals = clean.epochs.front().signals;
    signals = epoch.signals;
    for (Signal& s : signals) {
      for (const SatelliteView& view : exact.epochs.front().satellites) {
        if (view.satellite != s.satellite) continue;
        const double factor = std::sqrt(0.5 + 0.5 / std::sin(std::max(view.direction.elevation, 0.05)));
        *s.doppler += options.doppler_sigma * factor * noise() / view.wavelength;
      }
    }
    const RawRun run = run_raw(clean, options);
    const VelocityFix& v = *run.epochs.front().velocity;
    const Vector3d error = v.velocity - exact.epochs.front().velocity->velocity;
    nees += error.dot(v.covariance.ldlt().solve(error)) / kDraws;
    chi_square += v.chi_square;
    redundancy += v.redundancy;
  }
  EXPECT_NEAR(nees, 3, 0.5);
  EXPECT_NEAR(chi_square / redundancy, 1, 0.1);
}

TEST(Positioning, LeavesOutAReflectedSignal) {
  Flight flight;
  const SatelliteId id = flight.high();
  *flight.signal(3, id).pseudorange += 80;
  *flight.signal(3, id).doppler += 20;
  RawRun run = run_raw(flight.log, {});
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);
  SatelliteView* view = view_of(run.epochs[3], id);
  EXPECT_EQ(view->use, Use::outlier);
  EXPECT_NEAR(view->range_residual, 80, 0.1);
  EXPECT_EQ(view->rate_use, Use::outlier);
}

TEST(Positioning, FindsSlipsOfOneCycleAndHeedsFlags) {
  Flight flight;
  const SatelliteId id = flight.high();
  for (std::size_t i = 4; i < 8; ++i) *flight.signal(i, id).carrier += 1;  // told by the others
  RawRun run = run_raw(flight.log, {});
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);
  EXPECT_EQ(run.epochs[4].step->slips, 1);
  EXPECT_EQ(view_of(run.epochs[4], id)->phase_use, Use::outlier);
  EXPECT_EQ(run.epochs[5].step->slips, 0);

  for (std::size_t i = 6; i < 8; ++i) *flight.signal(i, id).carrier += 1e6;  // told by the Doppler
  flight.signal(2, id).lost_lock = true;                                     // said by the receiver
  run = run_raw(flight.log, {});
  EXPECT_EQ(run.epochs[6].step->slips, 1);
  EXPECT_EQ(run.epochs[2].step->slips, 1);
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);
}

TEST(Positioning, AJumpOfTheReceiversClockIsNoSlip) {
  Flight flight;
  const double jump = 1e-3 * kSpeedOfLight;
  for (std::size_t i = 4; i < 8; ++i) {
    flight.log.epochs[i].time = later(flight.log.epochs[i].time, 1e-3);
    for (Signal& s : flight.log.epochs[i].signals) {
      const bool beidou = s.satellite.system == System::beidou;
      *s.pseudorange += jump;
      *s.carrier += jump * carrier_frequency(s.satellite.system, beidou ? '2' : '1', 0) / kSpeedOfLight;
    }
  }
  const RawRun run = run_raw(flight.log, {});
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);
  EXPECT_EQ(run.epochs[4].step->slips, 0);
  EXPECT_NEAR(run.epochs[4].step->clock_step, jump + 6, 0.1);
}

TEST(Positioning, NamesWhatCannotBeUsed) {
  Flight flight;
  const SatelliteId id = flight.high();
  for (KeplerEphemeris& e : flight.log.broadcast.kepler) {
    if (e.satellite == id) e.health = 1;
  }
  flight.log.epochs[0].signals.push_back(flight.log.epochs[0].signals.front());
  flight.log.epochs[0].signals.back().satellite = {System::glonass, 5};
  RawRun run = run_raw(flight.log, {});
  EXPECT_EQ(view_of(run.epochs[0], id)->use, Use::unhealthy);
  EXPECT_EQ(view_of(run.epochs[0], {System::glonass, 5})->use, Use::no_ephemeris);
  EXPECT_EQ(run.uses[static_cast<std::size_t>(Use::no_ephemeris)], 1U);
  expect_truth(run, flight.receiver, 2e-3, 0.03, 5e-4);
}

TEST(Positioning, WithTooFewSatellitesThereIsNoAnswer) {
  Flight flight;
  for (Epoch& epoch : flight.log.epochs) epoch.signals.resize(3);
  const RawRun run = run_raw(flight.log, {});
  EXPECT_EQ(run.without_position, 8U);
  RawLog nothing;
  EXPECT_TRUE(run_raw(nothing, {}).epochs.empty());
}

TEST(Positioning, CrossesTheEndOfAWeek) {
  // The same sky and flight, moved so that the week ends between toe and epochs.
  Flight flight;
  const std::int64_t shift = (3 * 86400 + 43200) * kSecondInNanoseconds + 1;
  for (KeplerEphemeris& e : flight.log.broadcast.kepler) {
    e.toe.nanoseconds -= shift;
    e.toc.nanoseconds -= shift;
  }
  for (Epoch& epoch : flight.log.epochs) epoch.time.nanoseconds -= shift;
  flight.log.broadcast.ionosphere.reset();
  Flight still;
  still.log.broadcast.ionosphere.reset();
  const RawRun moved = run_raw(flight.log, {});
  const RawRun same = run_raw(still.log, {});
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_LT((moved.epochs[i].position->position - same.epochs[i].position->position).norm(), 1e-3);
  }
}

TEST(Positioning, KnownRangesNeedNoEphemerides) {
  const Flight flight;
  RawLog log;
  KnownRangeEpoch epoch;
  for (const SatelliteView& view : views_of(flight.log.epochs[0], flight.data, {})) {
    epoch.ranges.push_back(
        {view.satellite, view.state.position, range_between(view.state.position, stuttgart()) + 1234, 5, 45});
  }
  epoch.ranges.front().range += 500;
  log.known_ranges.push_back(epoch);
  const RawRun run = run_raw(log, {});
  ASSERT_TRUE(run.epochs.front().position);
  EXPECT_LT((run.epochs.front().position->position - stuttgart()).norm(), 1e-3);
  EXPECT_FALSE(run.epochs.front().velocity);
}

/// An epoch at rest under an air of the test's own: exponential troposphere, ionosphere of a thin shell.
Epoch under_own_air(const BroadcastData& data, const Vector3d& place, double seconds, double ionosphere) {
  const Receiver receiver{[&](double) { return place; }};
  const Geodetic where = geodetic_of(place);
  BroadcastData bare = data;
  bare.ionosphere.reset();
  Epoch epoch = observe(bare, receiver, seconds);
  for (Signal& s : epoch.signals) {
    for (const KeplerEphemeris& e : data.kepler) {
      if (e.satellite != s.satellite) continue;
      const Direction seen =
          direction_of(arrival(e, receiver.path, seconds).sent.position - place, enu_axes(where));
      const double air = 2.4 * std::exp(-where.height / 7800) / std::sin(std::max(seen.elevation, 0.05));
      const double flat = 0.9497 * std::cos(seen.elevation);  // sine of the zenith angle 350 km up
      *s.pseudorange += air - troposphere_delay(where, seen) + ionosphere / std::sqrt(1 - flat * flat);
    }
  }
  return epoch;
}

TEST(Positioning, WorksBelowTheSeaAndInTheAir) {
  for (const double height : {-430.0, -107.0, -101.0, -100.0, -99.0, 3000.0, 9999.0, 11000.0, 20000.0}) {
    const Vector3d place = ecef_of({0.096, 1.396, height});
    RawLog log;
    log.broadcast = sky();
    log.broadcast.ionosphere = IonosphereModel{};  // its 5 ns of the night are 1.5 m
    for (int i = 0; i < 20; ++i) log.epochs.push_back(under_own_air(log.broadcast, place, 30 * i, 1.5));
    const RawRun run = run_raw(log, {});
    EXPECT_EQ(run.without_position, 0U) << height;
    for (const EpochResult& e : run.epochs) {
      if (!e.position) continue;
      EXPECT_LT((e.position->position - place).norm(), 2.5) << height;
    }
  }
}

TEST(Positioning, AnUnknownIonosphereIsSaidInTheSigma) {
  const Vector3d place = stuttgart();
  const Vector3d up = enu_axes(geodetic_of(place)).row(2);
  for (const double zenith : {1.5, 5.0, 8.0, 10.0}) {
    RawLog log;
    log.broadcast = sky();
    log.broadcast.ionosphere.reset();
    log.epochs.push_back(under_own_air(log.broadcast, place, 0, zenith));
    const RawRun run = run_raw(log, {});
    ASSERT_TRUE(run.epochs.front().position);
    const PositionFix& fix = *run.epochs.front().position;
    const double sigma = std::sqrt(up.dot(fix.covariance * up));
    const double error = up.dot(fix.position - place);
    EXPECT_LT(std::abs(error), 2.5 * sigma) << zenith;
    EXPECT_LT(std::abs(error), 2 * std::abs(zenith - 5) + 2) << zenith;
    log.broadcast.ionosphere = sky().ionosphere;
    const RawRun known = run_raw(log, {});
    const Eigen::Matrix3d& covariance = known.epochs.front().position->covariance;
    EXPECT_GT(sigma, std::sqrt(up.dot(covariance * up))) << zenith;
  }
}

/// A receiver whose Doppler and phases are as noisy as said, and what is claimed of velocity and step.
TEST(Positioning, TheNoiseOfAReceiverIsFoundFromItsResiduals) {
  for (const double times : {0.5, 1.0, 3.0, 10.0}) {
    const Vector3d place = stuttgart();
    const Receiver receiver{[&](double) { return place; }};
    RawLog log;
    log.broadcast = sky();
    Normal noise;
    const PositioningOptions options;
    for (int i = 0; i < 80; ++i) {
      log.epochs.push_back(observe(log.broadcast, receiver, 0.2 * i));
      for (Signal& s : log.epochs.back().signals) {
        const double wavelength = kSpeedOfLight / carrier_frequency(s.satellite.system, s.code[0], 0);
        // Rather even over the sky, so that the factor of the elevation is but part of the truth.
        *s.doppler += times * options.doppler_sigma * noise() / wavelength;
        *s.carrier += times * options.phase_sigma * noise() / wavelength;
      }
    }
    const RawRun run = run_raw(log, options);
    double velocity = 0, step = 0, claimed_velocity = 0, claimed_step = 0;
    int velocities = 0, steps = 0;
    for (std::size_t i = 40; i < run.epochs.size(); ++i) {
      if (const auto& v = run.epochs[i].velocity) {
        velocity += v->velocity.squaredNorm(), claimed_velocity += v->covariance.trace(), ++velocities;
      }
      if (const auto& s = run.epochs[i].step) {
        step += s->step.squaredNorm(), claimed_step += s->covariance.trace(), ++steps;
      }
    }
    EXPECT_EQ(velocities, 40) << times;
    EXPECT_GE(steps, 38) << times;
    // Of a receiver that is better than assumed nothing is made less.
    const double least = times < 1 ? 0.2 : 0.7;
    EXPECT_GT(std::sqrt(velocity / claimed_velocity), times < 1 ? 0.3 : 0.7) << times;
    EXPECT_LT(std::sqrt(velocity / claimed_velocity), 1.4) << times;
    EXPECT_GT(std::sqrt(step / claimed_step), least) << times;
    EXPECT_LT(std::sqrt(step / claimed_step), 1.4) << times;
    EXPECT_EQ(remarks_on(run.noise, options).size(), times > 2 ? 2U : 0U) << times;
    // Who knows the receiver is believed.
    PositioningOptions known = options;
    known.estimate_doppler_sigma = known.estimate_phase_sigma = false;
    EXPECT_TRUE(remarks_on(run.noise, known).empty());
  }
}

/// Every satellite's range may be wrong by any amount, in the first epoch too, where nothing is known yet.
TEST(Positioning, OneAbsurdRangeTakesNoPosition) {
  const Flight flight;
  for (const double wrong : {1e5, 1e7, 2.9e7, 3.1e7, 5e7, 1e8, 1e9, 9e9, -1e7, -1e8}) {
    for (const std::size_t which : {0U, 5U, 11U}) {
      RawLog log = flight.log;
      log.epochs.resize(1);
      *log.epochs[0].signals.at(which).pseudorange += wrong;
      const RawRun run = run_raw(log, {});
      ASSERT_TRUE(run.epochs[0].position) << wrong << " " << which;
      EXPECT_LT((run.epochs[0].position->position - stuttgart()).norm(), 3) << wrong << " " << which;
    }
  }
}

/// Of two orbits that a satellite sends one after the other none is exact: their difference is no motion.
TEST(Positioning, AChangeOfTheOrbitsIsNoStep) {
  Flight flight;
  std::erase_if(flight.data.kepler, [](const auto& e) { return e.satellite.system != System::gps; });
  flight.log.epochs.clear();
  for (int i = 0; i < 8; ++i) flight.log.epochs.push_back(observe(flight.data, flight.receiver, i));
  flight.log.broadcast = flight.data;
  double sign = 0.3;
  for (const KeplerEphemeris& e : flight.data.kepler) {
    KeplerEphemeris next = e;
    next.toe.nanoseconds += 8 * kSecondInNanoseconds;  // the nearer one from 4 s on
    next.toe_of_week += 8;
    const double mean_motion = std::sqrt(3.986005e14 / std::pow(e.sqrt_a, 6)) + e.delta_n;
    next.m0 += 8 * mean_motion, next.omega0 += 8 * e.omega_dot, next.i0 += 8 * e.idot;
    next.af0 += sign * (1 + 0.1 * e.satellite.number) / kSpeedOfLight;
    sign = -sign;
    flight.log.broadcast.kepler.push_back(next);
  }
  const RawRun run = run_raw(flight.log, {});
  int steps = 0;
  for (std::size_t i = 1; i < 8; ++i) {
    const auto& step = run.epochs[i].step;
    if (!step) continue;
    ++steps;
    const double t = static_cast<double>(i);
    EXPECT_LT((step->step - (flight.receiver.path(t) - flight.receiver.path(t - 1))).norm(), 2e-3) << i;
    EXPECT_EQ(step->slips, 0) << i;
  }
  EXPECT_EQ(steps, 6);
}

TEST(Positioning, PhasesThatAllSlippedMakeNoStep) {
  Flight flight;
  int i = 0;
  for (Signal& s : flight.log.epochs[4].signals) *s.carrier += 1 + 7 * i++ % 5;
  for (std::size_t k = 5; k < 8; ++k) {
    i = 0;
    for (Signal& s : flight.log.epochs[k].signals) *s.carrier += 1 + 7 * i++ % 5;
  }
  const RawRun run = run_raw(flight.log, {});
  EXPECT_FALSE(run.epochs[4].step);
  EXPECT_TRUE(run.epochs[3].step);
  EXPECT_TRUE(run.epochs[5].step);
}

TEST(Positioning, SatellitesWithoutASignalThatIsUsedAreNamed) {
  Flight flight;
  const SatelliteId id = flight.high();
  for (Epoch& epoch : flight.log.epochs) {
    for (Signal& s : epoch.signals) {
      if (s.satellite == id) s.code = {'5', 'Q'};
    }
  }
  const auto said = unusable_satellites(run_raw(flight.log, {}));
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0], "no pseudorange in the first band: " + to_string(id) + " (8 epochs)");
}

TEST(RangeGeometry, DerivativesAreThoseOfTheRange) {
  const SatelliteState s = satellite_state(orbit({System::gps, 11}, 0.3, 0.8), 100);
  const Vector3d at = stuttgart();
  const auto range = [&](const Vector3d& d) {
    return Eigen::Matrix<double, 1, 1>(range_between(s.position, at + 1e4 * d) / 1e4);
  };
  navigation::expect_jacobian<1, 3>(range_gradient(s.position, at).transpose(), range, 1e-6);
}

TEST(RangeGeometry, SagnacIsTheTurnOfTheEarthWhileTheSignalTravels) {
  const KeplerEphemeris e = orbit({System::gps, 11}, 0.3, 0.8);
  const Arrival a = arrival(
      e, [](double) { return stuttgart(); }, 50);
  EXPECT_NEAR(range_between(a.sent.position, stuttgart()), a.range, 1e-3);
  EXPECT_GT(std::abs((a.sent.position - stuttgart()).norm() - a.range), 1);
}

TEST(LeastSquares, RefusesWhatIsNotDetermined) {
  std::array<Equation, 5> equations;
  EXPECT_FALSE(solve(std::span<Equation>()));
  for (Equation& e : equations) e.coefficients << 1, 2, 0, 0, 0, 0, 0;
  EXPECT_FALSE(solve(equations));
  for (std::size_t i = 0; i < 5; ++i) equations.at(i).coefficients[0] = static_cast<double>(i);
  const auto found = solve(equations);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->redundancy, 3);
  EXPECT_EQ(found->covariance(3, 3), 0);
}

}  // namespace
}  // namespace pade::gnss
