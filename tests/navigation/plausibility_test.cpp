#include "pade/navigation/plausibility/plausibility.hpp"

#include <algorithm>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/navigation/plausibility/force_match.hpp"
#include "pade/navigation/plausibility/position_lag.hpp"
#include "pade/navigation/replay.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

using testing::Contains;
using testing::Field;
using testing::IsEmpty;
using testing::Not;

constexpr double kDegree = std::numbers::pi / 180;

NavigationLog good(double speed = 1, std::uint64_t seed = 1) {
  return record({.rest = 2, .speed = speed}, 40, simulation::ImuModel::consumer(),
                simulation::GnssModel::single_point(), seed);
}

auto has(const char* id) { return Contains(Field(&Hint::id, id)); }

/// The lag that a hint names: "the GNSS velocities are 0.25 s late ...".
double lag_of(const std::vector<Hint>& hints) {
  constexpr std::string_view kBefore = "velocities are ";
  for (const Hint& hint : hints) {
    const std::size_t at = hint.message.find(kBefore);
    if (hint.id != "gnss-lag" || at == std::string::npos) continue;
    const double lag = std::stod(hint.message.substr(at + kBefore.size()));
    return hint.message.find(" s early") == std::string::npos ? lag : -lag;
  }
  return 0;
}

TEST(LogCheck, HasNothingToSayOfGoodLogs) {
  for (const double speed : {0.3, 1.0, 2.0}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const auto hints = check_log(good(speed, seed));
      EXPECT_THAT(hints, IsEmpty()) << speed << ' ' << seed << ": "
                                    << (hints.empty() ? "" : hints[0].message);
    }
  }
}

TEST(LogCheck, KnowsDegreesPerSecondInGentleFlight) {
  auto log = good(0.3);
  for (ImuSample& sample : log.imu) sample.angular_rate /= kDegree;
  EXPECT_THAT(check_log(log), has("gyro-unit"));
}

TEST(LogCheck, KnowsGyroscopesInOtherAxesThanAccelerometers) {
  auto log = good();
  for (ImuSample& sample : log.imu)
    sample.angular_rate = sample.angular_rate.cwiseProduct(Vector3d(1, -1, -1));
  EXPECT_THAT(check_log(log), has("gyro-axes"));
}

TEST(LogCheck, KnowsForwardRightDownCalledForwardLeftUp) {
  auto log = good();
  for (ImuSample& sample : log.imu) {
    sample.angular_rate = sample.angular_rate.cwiseProduct(Vector3d(1, -1, -1));
    sample.specific_force = sample.specific_force.cwiseProduct(Vector3d(1, -1, -1));
  }
  EXPECT_THAT(check_log(log), has("upside-down"));
}

TEST(LogCheck, KnowsNorthEastDownCalledEastNorthUp) {
  // The flight of the other tests hardly climbs: what tells is the vertical.
  auto log = good(2);
  for (GnssVelocity& v : log.gnss.velocities)
    v.velocity = Vector3d(v.velocity.y(), v.velocity.x(), -v.velocity.z());
  EXPECT_THAT(check_log(log), has("gnss-axes"));
}

TEST(LogCheck, MeasuresTheLagOfTheGnss) {
  for (const double lag : {0.15, 0.3, -0.2}) {
    auto log = good(2);
    for (GnssVelocity& v : log.gnss.velocities) v.time.nanoseconds += Time::from_seconds(lag).nanoseconds;
    EXPECT_NEAR(lag_of(check_log(log)), lag, 0.06);
  }
}

TEST(LogCheck, MeasuresTheLagOfThePositionsAlone) {
  for (const double lag : {0.2, 0.3, -0.3, 1.0}) {
    auto log = record({.rest = 2, .speed = 2}, 120, simulation::ImuModel::consumer(),
                      simulation::GnssModel::single_point(), 1);
    for (GnssFix& fix : log.gnss.fixes) fix.time.nanoseconds += Time::from_seconds(lag).nanoseconds;
    const auto measured = position_lag(log.gnss);
    ASSERT_TRUE(measured) << lag;
    EXPECT_NEAR(measured->seconds, lag, std::max(0.02, 4 * measured->sigma));
    EXPECT_LT(measured->sigma, 0.06);
    const auto hints = check_log(log);
    EXPECT_THAT(hints, has("gnss-apart")) << lag;
    EXPECT_THAT(hints, Not(has("gnss-lag"))) << "the velocities are punctual";
  }
}

TEST(LogCheck, SeesVelocitiesThatPartFromThePositions) {
  const auto flown = [](const Vector3d& bias) {
    auto log = record({.rest = 2, .speed = 2}, 240, simulation::ImuModel::consumer(),
                      simulation::GnssModel::single_point(), 1);
    for (GnssVelocity& v : log.gnss.velocities) v.velocity += bias;
    return log;
  };
  EXPECT_FALSE(position_drift(flown(Vector3d::Zero()).gnss, 0));
  EXPECT_THAT(check_log(flown(Vector3d::Zero())), Not(has("gnss-drift")));
  for (int axis = 0; axis < 3; ++axis) {
    const auto log = flown(-0.2 * Vector3d::Unit(axis));
    const auto drift = position_drift(log.gnss, 0);
    ASSERT_TRUE(drift) << axis;
    EXPECT_EQ(drift->axis, axis);
    EXPECT_NEAR(drift->metres / drift->seconds, -0.2, 0.05);
    EXPECT_THAT(check_log(log), has("gnss-drift"));
  }
}

TEST(LogCheck, AGapInTheVelocitiesIsNoDrift) {
  auto log = record({.rest = 2, .speed = 2}, 240, simulation::ImuModel::consumer(),
                    simulation::GnssModel::single_point(), 1);
  std::erase_if(log.gnss.velocities, [&](const GnssVelocity& v) {
    const double t = seconds_between(log.gnss.velocities.front().time, v.time);
    return t > 60 && t < 130;
  });
  EXPECT_FALSE(position_drift(log.gnss, 0));
}

TEST(LogCheck, TellsWhatIsLate) {
  // Both are late by 0.5 s, the positions by another 0.3 s.
  auto log = record({.rest = 2, .speed = 2}, 120, simulation::ImuModel::consumer(),
                    simulation::GnssModel::single_point(), 1);
  for (GnssVelocity& v : log.gnss.velocities) v.time.nanoseconds += 500'000'000;
  for (GnssFix& fix : log.gnss.fixes) fix.time.nanoseconds += 800'000'000;
  const auto hints = check_log(log);
  const auto late =
      std::find_if(hints.begin(), hints.end(), [](const Hint& h) { return h.id == "gnss-apart"; });
  ASSERT_NE(late, hints.end());
  const auto after = [&](const std::string& option) {
    return std::stod(late->advice.substr(late->advice.find(option) + option.size()));
  };
  EXPECT_NEAR(after("--gnss-latency "), 0.8, 0.12) << late->advice;
  EXPECT_NEAR(after("--gnss-velocity-latency "), 0.5, 0.06) << late->advice;
  EXPECT_NEAR(lag_of(hints), 0.5, 0.06);
  for (const Hint& hint : hints) {
    if (hint.id != "gnss-lag") continue;
    EXPECT_THAT(hint.advice, Not(testing::HasSubstr("--gnss-latency")))
        << "which would move the positions by the same";
  }
}

TEST(LogCheck, TellsVelocitiesThatAreLateFromPositionsThatAreEarly) {
  auto log = record({.rest = 2, .speed = 2}, 120, simulation::ImuModel::consumer(),
                    simulation::GnssModel::carrier_phase(), 1);
  for (GnssVelocity& v : log.gnss.velocities) v.time.nanoseconds += 120'000'000;
  const auto hints = check_log(log);
  const auto apart =
      std::find_if(hints.begin(), hints.end(), [](const Hint& h) { return h.id == "gnss-apart"; });
  ASSERT_NE(apart, hints.end());
  EXPECT_THAT(apart->message, testing::HasSubstr("the GNSS velocities are 0.12 s late"));
  EXPECT_THAT(apart->advice, testing::HasSubstr("--gnss-latency 0.00 --gnss-velocity-latency 0.12"));
}

TEST(LogCheck, KnowsLeapSeconds) {
  auto log = record({.rest = 2, .speed = 2}, 80, simulation::ImuModel::consumer(),
                    simulation::GnssModel::single_point(), 1);
  for (GnssVelocity& v : log.gnss.velocities) v.time.nanoseconds += Time::from_seconds(18).nanoseconds;
  const auto hints = check_log(log);
  EXPECT_NEAR(lag_of(hints), 18, 0.1);
}

TEST(LogCheck, KnowsPositionsInDegrees) {
  auto log = good(2);
  for (GnssFix& fix : log.gnss.fixes)
    fix.position = {47 + fix.position.x() * 1e-5, 8 + fix.position.y() * 1e-5, 400};
  EXPECT_THAT(check_log(log), has("gnss-degrees"));
}

TEST(LogCheck, KnowsVelocitiesInOtherUnitsThanPositions) {
  auto log = good(2);
  for (GnssVelocity& v : log.gnss.velocities) v.velocity *= 3.6;
  const auto hints = check_log(log);
  ASSERT_THAT(hints, has("gnss-contradiction"));
  EXPECT_NE(hints[0].message.find("km/h"), std::string::npos) << hints[0].message;
}

TEST(LogCheck, KnowsClocksWithoutOverlapAndClocksThatWereReset) {
  auto apart = good();
  for (GnssVelocity& v : apart.gnss.velocities) v.time.nanoseconds += 1'600'000'000'000'000'000;
  const auto hints = check_log(apart);
  ASSERT_THAT(hints, has("no-overlap"));
  EXPECT_EQ(hints[0].severity, HintSeverity::error);
  EXPECT_NE(hints[0].message.find("1600000000"), std::string::npos);
  auto reset = good();
  for (std::size_t i = 3000; i < reset.imu.size(); ++i) reset.imu[i].time.nanoseconds -= 15'000'000'000;
  EXPECT_THAT(check_log(reset), has("stamps-go-back"));
}

TEST(LogCheck, KnowsSamplesPickedFromAFasterStream) {
  auto log = good();
  NavigationLog picked = log;
  picked.imu.clear();
  for (std::size_t i = 0; i < log.imu.size(); i += 4) {
    log.imu[i].specific_force += Vector3d(3, 2, 4) * std::sin(1.1 * static_cast<double>(i * i));
    picked.imu.push_back(log.imu[i]);
  }
  EXPECT_THAT(check_log(picked), has("imu-picked"));
}

TEST(StampsOfTheImu, ArePutOnALineWhereTheyRepeat) {
  const auto log = good();
  auto jittered = log.imu;
  // A clock of 10 ms on samples every 5 ms, and packets of three.
  for (std::size_t i = 0; i < jittered.size(); ++i) jittered[i].time = log.imu[i / 3 * 3].time;
  const auto hint = regularise_stamps(jittered);
  ASSERT_TRUE(hint);
  EXPECT_EQ(hint->id, "imu-stamps-regularised");
  for (std::size_t i = 0; i < jittered.size(); ++i) {
    EXPECT_NEAR(seconds_between(log.imu[i].time, jittered[i].time), -0.005, 0.0051);
    if (i > 0) {
      EXPECT_GT(jittered[i].time, jittered[i - 1].time);
    }
  }
}

TEST(StampsOfTheImu, AreLeftAloneWhereTheyRiseOrWereReset) {
  auto log = good();
  const auto before = log.imu;
  EXPECT_FALSE(regularise_stamps(log.imu));
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(log.imu[i].time, before[i].time);
  for (std::size_t i = 3000; i < log.imu.size(); ++i) log.imu[i].time.nanoseconds -= 15'000'000'000;
  EXPECT_FALSE(regularise_stamps(log.imu));
}

TEST(StampsOfTheImu, KeepAGap) {
  auto log = good();
  const auto before = log.imu;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    log.imu[i].time = Time{before[i / 2 * 2].time.nanoseconds + (i >= 3000 ? 2'000'000'000 : 0)};
  }
  ASSERT_TRUE(regularise_stamps(log.imu));
  EXPECT_NEAR(seconds_between(log.imu[2999].time, log.imu[3000].time), 2.005, 0.006);
}

/// The innovations of a run.
std::vector<Measurement> measurements_of(const NavigationLog& log, Health& health) {
  std::vector<Measurement> measurements;
  Navigator navigator({});
  navigator.on_retired([&](const Measurement& m) { measurements.push_back(m); });
  ReplayOptions options;
  options.headings.push_back({Time::from_seconds(1), 0.7, 0.05});
  replay(log, navigator, options, {});
  health = navigator.health();
  return measurements;
}

TEST(RunCheck, SaysThatABarometerIsRefusedForEver) {
  auto log = good();
  for (int i = 0; i < 400; ++i) {  // feet for metres, and a climb that the vehicle does not make
    log.barometer.push_back({Time::from_seconds(0.1 * i), 400 + 30.0 * i, 0.1});
  }
  Health health;
  const auto hints = check_run(summarise(measurements_of(log, health)), health, log.imu.size());
  EXPECT_THAT(hints, has("sensor-refused"));
}

TEST(RunCheck, SaysThatTheFilterWasLostAndWhy) {
  Health health;
  health.times_lost = 2;
  health.restarts = health.restarts_when_lost = 1;
  EXPECT_THAT(check_run({}, health, 1000), has("lost"));
  EXPECT_THAT(check_run({}, health, 1000), Not(has("restarts"))) << "no gap was the reason";
  ++health.restarts;
  EXPECT_THAT(check_run({}, health, 1000), has("restarts"));
  EXPECT_THAT(check_run({}, health, 1000), Not(has("velocity-doubted")));
  health.velocity_doubted = 1;
  EXPECT_THAT(check_run({}, health, 1000), has("velocity-doubted"));
  EXPECT_THAT(check_run({}, health, 1000), Not(has("magnetometer-doubted")));
  health.magnetometer_doubted = 1;
  EXPECT_THAT(check_run({}, health, 1000), has("magnetometer-doubted"));
}

TEST(RunCheck, HasNothingToSayOfAGoodRun) {
  const auto log = good();
  Health health;
  const auto sensors = summarise(measurements_of(log, health));
  EXPECT_THAT(check_run(sensors, health, log.imu.size()), IsEmpty());
  ASSERT_THAT(sensors, Contains(Field(&SensorSummary::sensor, "gnss_velocity")));
  for (const SensorSummary& sensor : sensors) {
    if (sensor.sensor == "gnss_velocity") {
      EXPECT_NEAR(sensor.chi_square, 1, 0.5);
    }
  }
}

}  // namespace
}  // namespace pade::navigation
