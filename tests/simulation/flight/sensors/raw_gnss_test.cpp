// The simulated receiver against the least squares of navigation/gnss, which know nothing of it.
#include "pade/simulation/flight/sensors/raw_gnss.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "navigation/gnss/constellation.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

KinematicState motion(double t) {
  KinematicState state;
  state.time = Time::from_seconds(t);
  state.position = {3 * std::sin(t), 2 * t, 0.5 * std::cos(t)};
  state.velocity = {3 * std::cos(t), 2, -0.5 * std::sin(t)};
  return state;
}

struct Recorded {
  gnss::BroadcastData data = gnss::sky();
  gnss::RawLog log;
  std::vector<double> clocks;  // m

  explicit Recorded(const RawGnssModel& model, int epochs = 100, double interval = 0.2) {
    RawGnss receiver(model, data, gnss::geodetic_of(gnss::stuttgart()), gnss::noon(), 7);
    log.broadcast = data;
    for (int i = 0; i < epochs; ++i) {
      log.epochs.push_back(receiver.sample(motion(interval * i)));
      clocks.push_back(receiver.clock());
    }
  }
  [[nodiscard]] static Vector3d ecef(const KinematicState& state) {
    return gnss::stuttgart() +
           gnss::enu_axes(gnss::geodetic_of(gnss::stuttgart())).transpose() * state.position;
  }
};

RawGnssModel perfect() {
  RawGnssModel model;
  model.range_zenith = model.range_horizon = model.rate_white = model.phase_white = model.slips = 0;
  model.clock_noise = model.clock_walk = 0;
  return model;
}

TEST(SimulatedRawGnss, WithoutNoiseLeastSquaresGiveBackTheTruth) {
  const Recorded recorded(perfect());
  const gnss::RawRun run = run_raw(recorded.log, {});
  for (std::size_t i = 0; i < run.epochs.size(); ++i) {
    const auto& e = run.epochs[i];
    const auto now = motion(0.2 * static_cast<double>(i));
    ASSERT_TRUE(e.position && e.velocity);
    EXPECT_LT((e.position->position - Recorded::ecef(now)).norm(), 2e-3);
    EXPECT_NEAR(*e.position->clock[0], recorded.clocks[i], 2e-3);
    const Vector3d velocity = gnss::enu_axes(gnss::geodetic_of(gnss::stuttgart())) * e.velocity->velocity;
    EXPECT_LT((velocity - now.velocity).norm(), 1e-3);
    if (i == 0) continue;
    ASSERT_TRUE(e.step);
    const Vector3d step = Recorded::ecef(now) - Recorded::ecef(motion(0.2 * static_cast<double>(i - 1)));
    EXPECT_LT((e.step->step - step).norm(), 2e-4);
  }
}

TEST(SimulatedRawGnss, HasTheNoiseThatItSays) {
  RawGnssModel model = perfect();
  model.range_zenith = model.range_horizon = 1;
  model.rate_white = 0.05;
  model.phase_white = 0.002;
  const Recorded recorded(model, 300);
  const Recorded clean(perfect(), 300);
  double range = 0, rate = 0, phase = 0, count = 0;
  for (std::size_t i = 0; i < recorded.log.epochs.size(); ++i) {
    const auto& a = recorded.log.epochs[i].signals;
    const auto& b = clean.log.epochs[i].signals;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      const double wavelength =
          gnss::kSpeedOfLight / gnss::carrier_frequency(a[k].satellite.system, a[k].code[0], 0);
      range += std::pow(*a[k].pseudorange - *b[k].pseudorange, 2);
      rate += std::pow(wavelength * (*a[k].doppler - *b[k].doppler), 2);
      phase += std::pow(wavelength * (*a[k].carrier - *b[k].carrier), 2);
      count += 1;
    }
  }
  EXPECT_NEAR(std::sqrt(range / count), 1, 0.05);
  EXPECT_NEAR(std::sqrt(rate / count), 0.05, 0.0025);
  EXPECT_NEAR(std::sqrt(phase / count), 0.002, 0.0001);
}

TEST(SimulatedRawGnss, MasksTheSkyAndThePhasesWhenAsked) {
  RawGnssModel model;
  model.masked = {20, 15};
  model.canopy = {10, 4};
  const Recorded recorded(model, 200, 0.5);
  for (std::size_t i = 0; i < recorded.log.epochs.size(); ++i) {
    const double t = 0.5 * static_cast<double>(i);
    const auto& signals = recorded.log.epochs[i].signals;
    if (std::fmod(t, 20) >= 5) {
      EXPECT_EQ(signals.size(), 3U);
    } else {
      EXPECT_GT(signals.size(), 8U);
    }
    for (const auto& s : signals) EXPECT_EQ(s.carrier.has_value(), std::fmod(t, 10) < 6) << t;
  }
}

TEST(SimulatedRawGnss, SlipsAndReflectsAsOftenAsItSays) {
  RawGnssModel model = perfect();
  model.slips = 0.05;
  model.slips_said = 0.5;
  model.reflected = 0.2;
  model.clock_rate = 0;
  const Recorded recorded(model, 400);
  const gnss::RawRun run = run_raw(recorded.log, {});
  double flagged = 0, refused = 0, outliers = 0, all = 0;
  for (std::size_t i = 1; i < run.epochs.size(); ++i) {
    for (const auto& view : run.epochs[i].satellites) {
      all += 1;
      flagged += view.signal->lost_lock ? 1 : 0;
      refused += view.phase_use == gnss::Use::outlier ? 1 : 0;
      outliers += view.use == gnss::Use::outlier ? 1 : 0;
    }
  }
  EXPECT_NEAR(flagged / all, 0.025, 0.006);
  EXPECT_NEAR(refused / all, 0.05, 0.008);
  EXPECT_NEAR(outliers / all, 0.2, 0.05);
}

TEST(SimulatedRawGnss, ClockDriftsAndIsSetByAMillisecond) {
  RawGnssModel model = perfect();
  model.clock_rate = 1e-4;
  const Recorded recorded(model, 100);
  const double millisecond = 1e-3 * gnss::kSpeedOfLight;
  int jumps = 0;
  for (std::size_t i = 1; i < recorded.clocks.size(); ++i) {
    const double step = recorded.clocks[i] - recorded.clocks[i - 1];
    const double expected = 0.2 * 1e-4 * gnss::kSpeedOfLight;
    if (std::abs(step - expected) < 1) continue;
    EXPECT_NEAR(step, expected - millisecond, 1);
    ++jumps;
  }
  EXPECT_EQ(jumps, 2);
}

}  // namespace
}  // namespace pade::simulation
