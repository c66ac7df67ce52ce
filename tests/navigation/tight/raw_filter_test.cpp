// Raw GNSS in the filter, on a made-up flight under a made-up sky.
#include <algorithm>

#include <gtest/gtest.h>

#include "pade/evaluation/navigation_score.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/navigation/replay.hpp"
#include "pade/navigation/tight/raw_observer.hpp"
#include "pade/simulation/flight/sensors/raw_gnss.hpp"

#include "navigation/flight.hpp"
#include "navigation/gnss/constellation.hpp"

namespace pade::navigation {
namespace {

using RawEpochs = std::vector<std::shared_ptr<const RawEpoch>>;
using simulation::RawGnssModel;

constexpr double kDuration = 40;

class RawFilter : public testing::Test {
 protected:
  RawFilter() {
    log_ = record(Flight{}, kDuration, simulation::ImuModel::industrial(),
                  simulation::GnssModel::single_point(), 1);
    log_.gnss.fixes.clear();
    log_.gnss.velocities.clear();
  }

  static gnss::PositioningOptions weights() {
    gnss::PositioningOptions options;
    options.pseudorange_sigma = 0.5;
    options.doppler_sigma = 0.04;
    options.phase_sigma = 0.0016;
    options.estimate_doppler_sigma = options.estimate_phase_sigma = false;
    return options;
  }
  static gnss::Geodetic place() { return gnss::geodetic_of(gnss::stuttgart()); }

  [[nodiscard]] std::vector<gnss::Epoch> measured(const RawGnssModel& model) const {
    simulation::RawGnss receiver(model, data_, place(), gnss::noon(), 5);
    std::vector<gnss::Epoch> result;
    for (int i = 0; i < 5 * static_cast<int>(kDuration); ++i)
      result.push_back(receiver.sample(Flight{}.at(0.2 * i)));
    return result;
  }
  [[nodiscard]] RawEpochs prepared(const std::vector<gnss::Epoch>& epochs) const {
    RawObserver observer(data_, weights(), LocalFrame::at(place()), gnss::noon());
    RawEpochs result;
    for (const auto& e : epochs) result.push_back(observer.observe(e));
    return result;
  }

  struct Outcome {
    double velocity_rms = 0;    ///< from 15 s on, m/s
    double position_rms = 0;    ///< m
    double motion_rms = 0;      ///< over 0.1 s, m
    double nees = 0;            ///< of that motion, 3 expected
    double said_valid = 0;      ///< share of these motions
    double wrong_of_valid = 0;  ///< of those, the share that is wrong by more than a fifth of the length
    RawTally tally;
    Health health;
  };
  [[nodiscard]] Outcome fly(const RawEpochs& raw, bool tight = true, double latest = 0,
                            double asked_after = 0) const {
    NavigatorOptions options;
    options.filter.raw_gnss = tight;
    Navigator navigator(options);
    ReplayOptions replay_options;
    replay_options.raw = raw;
    replay_options.gnss_delay_high = latest;
    replay_options.headings.push_back({Time::from_seconds(1), 0.7, 0.03});
    Outcome outcome;
    double count = 0;
    std::size_t tick = 0;
    replay(log_, navigator, replay_options, [&](Time now) {
      if (++tick % 20 != 0 || now < Time::from_seconds(15)) return;
      const Time t2 = Time::from_seconds(now.seconds() - asked_after);
      const auto truth = evaluation::truth_at(log_.truth, t2);
      const auto pose = navigator.absolute_pose(t2);
      const Time t1 = Time::from_seconds(t2.seconds() - 0.1);
      const auto motion = navigator.relative_pose(t1, t2, Pose{});
      if (pose.answer != Answer::valid || motion.answer != Answer::valid || !truth) return;
      const auto error = evaluation::score({t1, t2, motion.motion}, log_.truth);
      outcome.velocity_rms += (pose.velocity - truth->velocity).squaredNorm();
      outcome.position_rms += (pose.T_world_body.translation - truth->T_world_body.translation).squaredNorm();
      outcome.motion_rms += error->translation * error->translation;
      outcome.nees += error->nees;
      outcome.said_valid += motion.scale_valid;
      outcome.wrong_of_valid += motion.scale_valid && error->translation > 0.2 * error->baseline;
      count += 1;
    });
    EXPECT_GT(count, 200);
    outcome.velocity_rms = std::sqrt(outcome.velocity_rms / count);
    outcome.position_rms = std::sqrt(outcome.position_rms / count);
    outcome.motion_rms = std::sqrt(outcome.motion_rms / count);
    outcome.nees /= count;
    outcome.wrong_of_valid /= std::max(outcome.said_valid, 1.0);
    outcome.said_valid /= count;
    outcome.tally = navigator.raw_tally();
    outcome.health = navigator.health();
    return outcome;
  }
  [[nodiscard]] Outcome fly(const RawGnssModel& model) const { return fly(prepared(measured(model))); }

  gnss::BroadcastData data_ = gnss::sky();
  NavigationLog log_;
};

TEST_F(RawFilter, PhasesMakeTheMotionBetterThanDopplerAndThatIsAsGoodAsTheSnapshots) {
  RawGnssModel canopy;
  canopy.canopy = {1, 1};
  const auto phases = fly(RawGnssModel{});
  const auto epochs = prepared(measured(canopy));
  const auto doppler = fly(epochs);
  const auto loose = fly(epochs, false);
  EXPECT_LT(phases.velocity_rms, 0.6 * doppler.velocity_rms);
  EXPECT_LT(phases.motion_rms, 0.8 * doppler.motion_rms);
  EXPECT_LT(doppler.velocity_rms, 1.1 * loose.velocity_rms);
  EXPECT_EQ(loose.tally.rates.used, 0U);
  EXPECT_EQ(doppler.tally.phases.used, 0U);
  for (const auto* const run : {&phases, &doppler, &loose}) {
    const Outcome& outcome = *run;
    EXPECT_LT(outcome.nees, 5);
    // The loose filter takes the white errors of these fixes for such that last.
    EXPECT_LT(outcome.position_rms, &outcome == &loose ? 8 : 2);
    EXPECT_EQ(outcome.health.times_lost, 0U);
    EXPECT_EQ(outcome.health.status, NavigationStatus::navigating);
  }
}

TEST_F(RawFilter, SlipsAreRefusedWhetherTheReceiverSaysThemOrNot) {
  RawGnssModel none, silent, said;
  none.slips = 0;
  silent.slips_said = 0;
  said.slips_said = 1;
  const auto clean = fly(none);
  EXPECT_LT(static_cast<double>(clean.tally.phases.refused),
            3e-3 * static_cast<double>(clean.tally.phases.used));
  const auto unsaid = fly(silent);
  // All of them, but for those of phases that had slipped already.
  EXPECT_GT(static_cast<double>(unsaid.tally.phases.refused),
            5e-3 * static_cast<double>(unsaid.tally.phases.used));
  EXPECT_LT(unsaid.motion_rms, 1.3 * clean.motion_rms);
  EXPECT_LT(fly(said).motion_rms, 1.3 * clean.motion_rms);
}

TEST_F(RawFilter, MillisecondJumpsOfTheClockAreFollowed) {
  RawGnssModel steady, jumping;
  steady.clock_rate = 0;
  jumping.clock_rate = 2e-6;
  jumping.clock = 4.6e-4;  // a jump after 20 s
  const auto clean = fly(steady);
  const auto jumps = fly(jumping);
  EXPECT_EQ(clean.tally.clock_jumps, 0U);
  EXPECT_EQ(jumps.tally.clock_jumps, 1U);
  EXPECT_LT(jumps.tally.rates.refused + jumps.tally.ranges.refused, 30U);
  EXPECT_LT(jumps.motion_rms, 1.1 * clean.motion_rms);
  // There are receivers whose phases do not jump with their ranges.
  auto epochs = measured(jumping);
  double taken = 0;
  Time last = epochs.front().time;
  for (gnss::Epoch& e : epochs) {
    const double drift = seconds_between(last, e.time) - 0.2;
    if (&e != &epochs.front() && std::abs(drift) > 5e-4) taken += std::round(drift * 1e3) * 1e-3;
    last = e.time;
    for (gnss::Signal& s : e.signals) {
      const double frequency = gnss::carrier_frequency(s.satellite.system, s.code[0], 0);
      if (s.carrier) *s.carrier -= taken * frequency;
    }
  }
  EXPECT_NE(taken, 0);
  const auto apart = fly(prepared(epochs));
  EXPECT_LT(apart.motion_rms, 1.1 * clean.motion_rms);
  EXPECT_GT(static_cast<double>(apart.tally.phases.used),
            0.95 * static_cast<double>(jumps.tally.phases.used));
}

TEST_F(RawFilter, AFifthOfTheRangesTooLongDoesLittleHarm) {
  RawGnssModel reflected;
  reflected.reflected = 0.2;
  const auto clean = fly(RawGnssModel{});
  const auto outcome = fly(reflected);
  EXPECT_LT(outcome.motion_rms, 1.3 * clean.motion_rms);
  EXPECT_LT(outcome.position_rms, 8);
  const auto& ranges = outcome.tally.ranges;
  EXPECT_NEAR(static_cast<double>(ranges.refused) / static_cast<double>(ranges.used + ranges.refused), 0.19,
              0.04);
}

TEST_F(RawFilter, ThreeSatellitesHoldTheVelocity) {
  RawGnssModel masked;
  masked.masked = {20, 15};
  const auto epochs = prepared(measured(masked));
  EXPECT_LT(fly(epochs).velocity_rms, 0.7 * fly(epochs, false).velocity_rms);
}

TEST_F(RawFilter, LateEpochsGiveTheSameBits) {
  const auto epochs = prepared(measured({}));
  const auto punctual = fly(epochs, true, 0, 0.3);
  const auto late = fly(epochs, true, 0.3, 0.3);
  EXPECT_EQ(punctual.motion_rms, late.motion_rms);
  EXPECT_EQ(punctual.velocity_rms, late.velocity_rms);
  EXPECT_EQ(punctual.tally.phases.used, late.tally.phases.used);
  EXPECT_EQ(punctual.tally.ranges.refused, late.tally.ranges.refused);
  EXPECT_EQ(punctual.tally.rates.used, late.tally.rates.used);
}

TEST_F(RawFilter, AFilterThatIsWrongComesBack) {
  // From 20 s on the IMU is turned by 20 degrees about its x axis: all rates and ranges contradict it soon.
  for (ImuSample& sample : log_.imu) {
    if (sample.time < Time::from_seconds(20)) continue;
    const Quaterniond turn(Eigen::AngleAxisd(0.35, Vector3d::UnitX()));
    sample.specific_force = turn * sample.specific_force;
    sample.angular_rate = turn * sample.angular_rate;
  }
  const auto outcome = fly(RawGnssModel{});
  EXPECT_GT(outcome.health.times_lost, 0U);
  EXPECT_NE(outcome.health.status, NavigationStatus::lost);
  EXPECT_LT(outcome.velocity_rms, 1);
}

TEST_F(RawFilter, EpochsWithoutUseAreSurvived) {
  RawEpochs epochs = prepared(measured({}));
  RawEpoch empty, infinite;
  empty.time = Time::from_seconds(20.05);
  infinite = *epochs[105];
  infinite.time = Time::from_seconds(21.05);
  for (RawSatellite& s : infinite.satellites) s.range = s.rate = s.phase = INFINITY;
  infinite.satellites.resize(70, infinite.satellites.front());
  epochs.push_back(std::make_shared<RawEpoch>(empty));
  epochs.push_back(std::make_shared<RawEpoch>(infinite));
  const auto outcome = fly(epochs);
  EXPECT_LT(outcome.velocity_rms, 0.1);
  EXPECT_LT(outcome.position_rms, 2);
}

TEST_F(RawFilter, SatellitesWithoutAUsableEphemerisAreMissedAndNotBelieved) {
  const auto epochs = measured({});
  const auto all = prepared(epochs);
  std::vector<gnss::SatelliteId> unusable;
  for (std::size_t i = 0; i < 3; ++i) unusable.push_back(all.front()->satellites.at(i).satellite);
  // The first has none, that of the second is unhealthy, of the third too old; that these two are wrong
  // besides would show.
  std::erase_if(data_.kepler, [&](const auto& e) { return e.satellite == unusable[0]; });
  for (gnss::KeplerEphemeris& e : data_.kepler) {
    if (e.satellite == unusable[1]) e.health = 1, e.m0 += 0.1;
    if (e.satellite == unusable[2]) e.toe.nanoseconds -= 3LL * 3600 * gnss::kSecondInNanoseconds;
  }
  const auto left = prepared(epochs);
  ASSERT_EQ(left.size(), all.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    EXPECT_EQ(left[i]->satellites.size() + 3, all[i]->satellites.size());
    for (const RawSatellite& s : left[i]->satellites) {
      EXPECT_EQ(std::find(unusable.begin(), unusable.end(), s.satellite), unusable.end());
    }
  }
  const auto outcome = fly(left);
  EXPECT_LT(outcome.velocity_rms, 0.1);
  EXPECT_LT(outcome.position_rms, 2);
  gnss::RawLog log;
  log.epochs = epochs;
  log.broadcast = data_;
  const auto said = gnss::unusable_satellites(gnss::run_raw(log, weights()));
  ASSERT_EQ(said.size(), 3U);
  EXPECT_EQ(said[0], "no ephemeris: " + to_string(unusable[0]) + " (200 epochs)");
  EXPECT_EQ(said[1], "stale ephemeris: " + to_string(unusable[2]) + " (200 epochs)");
  EXPECT_EQ(said[2], "unhealthy: " + to_string(unusable[1]) + " (200 epochs)");
}

TEST_F(RawFilter, TheEndOfAWeekIsNothingSpecial) {
  auto epochs = measured({});
  data_.ionosphere.reset();  // which knows the time of day
  const auto before = prepared(epochs);
  const std::int64_t shift =
      (3 * 86400 + 43200 + 20) * gnss::kSecondInNanoseconds;  // the week ends after 20 s
  for (gnss::KeplerEphemeris& e : data_.kepler) {
    e.toe.nanoseconds -= shift;
    e.toc.nanoseconds -= shift;
  }
  for (gnss::Epoch& epoch : epochs) epoch.time.nanoseconds -= shift;
  RawObserver observer(data_, weights(), LocalFrame::at(place()), Time{gnss::noon().nanoseconds - shift});
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    const auto after = observer.observe(epochs[i]);
    ASSERT_EQ(after->satellites.size(), before[i]->satellites.size());
    EXPECT_EQ(after->time, before[i]->time);
    for (std::size_t k = 0; k < after->satellites.size(); ++k) {
      EXPECT_LT((after->satellites[k].position - before[i]->satellites[k].position).norm(), 1e-3);
      EXPECT_NEAR(*after->satellites[k].range, *before[i]->satellites[k].range, 1e-3);
    }
  }
}

TEST_F(RawFilter, RepeatedEpochsDoNoHarm) {
  RawEpochs twice;
  for (const auto& epoch : prepared(measured({}))) twice.insert(twice.end(), {epoch, epoch});
  const auto outcome = fly(twice);
  EXPECT_LT(outcome.velocity_rms, 0.1);
  EXPECT_LT(outcome.position_rms, 2);
  EXPECT_LT(outcome.nees, 5);
}

/// From 20 s on the gyroscope's x axis is wrong by 0.05 rad/s.
void turn_gyroscope(NavigationLog& log) {
  for (ImuSample& sample : log.imu) {
    if (sample.time >= Time::from_seconds(20)) sample.angular_rate.x() += 0.05;
  }
}

TEST_F(RawFilter, WithoutDopplerPhasesWatchTheFilter) {
  auto epochs = measured({});
  for (gnss::Epoch& epoch : epochs) {
    for (gnss::Signal& s : epoch.signals) s.doppler.reset();
  }
  const auto good = fly(prepared(epochs));
  EXPECT_EQ(good.tally.rates.used, 0U);
  EXPECT_EQ(good.health.status, NavigationStatus::navigating);
  EXPECT_EQ(good.health.times_lost, 0U);
  EXPECT_LT(good.velocity_rms, 0.1);
  turn_gyroscope(log_);
  const auto bad = fly(prepared(epochs));
  EXPECT_GT(bad.health.times_lost, 0U);
  EXPECT_NE(bad.health.status, NavigationStatus::lost);
  EXPECT_LT(bad.wrong_of_valid, 0.05);
  EXPECT_GT(bad.said_valid, 0.3);
  EXPECT_LT(bad.velocity_rms, 1);
}

TEST_F(RawFilter, AReceiverNoisierThanAssumedIsNoFault) {
  // As a receiver of 5 cm/s and 2 mm, and one of three times that, by weights of another of 1.6 cm/s and 0.9
  // mm.
  for (const double times : {1.0, 3.0}) {
    RawGnssModel model;
    model.rate_white *= times, model.phase_white *= times;
    RawObserver observer(data_, {}, LocalFrame::at(place()), gnss::noon());
    RawEpochs epochs;
    for (const auto& e : measured(model)) epochs.push_back(observer.observe(e));
    const auto outcome = fly(epochs);
    EXPECT_EQ(outcome.health.times_lost, 0U) << times;
    EXPECT_LT(outcome.velocity_rms, 0.05 * times) << times;
    EXPECT_LT(outcome.nees, 6) << times;
    EXPECT_LT(outcome.wrong_of_valid, 0.01) << times;
    const auto& rates = outcome.tally.rates;
    EXPECT_LT(static_cast<double>(rates.refused), 0.02 * static_cast<double>(rates.used)) << times;
  }
}

/// GPS joins the others, whose signals are some hundred metres off its time.
TEST_F(RawFilter, GpsThatComesLaterIsTakenIn) {
  const auto shifted = [&](gnss::System system, double metres, Time absent_until) {
    auto epochs = measured({});
    for (gnss::Epoch& epoch : epochs) {
      const Time time{epoch.time.nanoseconds - gnss::noon().nanoseconds};
      const auto is_of = [&](const gnss::Signal& s) { return s.satellite.system == system; };
      if (time < absent_until) std::erase_if(epoch.signals, is_of);
      for (gnss::Signal& s : epoch.signals) {
        if (is_of(s)) *s.pseudorange += metres;
      }
    }
    return fly(prepared(epochs));
  };
  const auto joined = shifted(gnss::System::gps, 150, Time::from_seconds(12));
  EXPECT_LT(static_cast<double>(joined.tally.ranges.refused),
            0.02 * static_cast<double>(joined.tally.ranges.used));
  EXPECT_LT(joined.position_rms, 3);
  EXPECT_LT(joined.velocity_rms, 0.1);
}

TEST_F(RawFilter, WhatWasUsedBeforeARestartIsCounted) {
  const auto whole = fly(prepared(measured({})));
  std::erase_if(log_.imu, [](const ImuSample& sample) {
    return sample.time > Time::from_seconds(36) && sample.time < Time::from_seconds(39.5);
  });
  const auto cut = fly(prepared(measured({})));
  EXPECT_EQ(cut.health.restarts, 1U);
  EXPECT_EQ(cut.health.status, NavigationStatus::uninitialised);
  EXPECT_GT(cut.tally.ranges.used, whole.tally.ranges.used / 2);
}

}  // namespace
}  // namespace pade::navigation
