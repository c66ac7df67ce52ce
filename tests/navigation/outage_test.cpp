// What comes and goes: GNSS that is away in a turn, velocities that end, measurements of another time, clocks
// that are set.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pade/navigation/filter.hpp"
#include "pade/navigation/navigation_run.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

/// At rest, then up to `speed` and on in an S for good: what a vehicle of that speed turns in while nobody
/// measures it.
struct Weave {
  explicit Weave(double flown_at) : speed(flown_at) {}
  double speed;

  [[nodiscard]] simulation::KinematicState at(double t) const {
    constexpr double kRest = 5;
    constexpr double kStep = 0.01;
    simulation::KinematicState state;
    state.time = Time::from_seconds(t);
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    // The way in closed form would hide nothing: it is summed finely enough for the truth that is asked of
    // it.
    const auto yaw_at = [](double u) { return 0.5 + 0.83 * (1 - std::cos(0.3 * std::max(0.0, u - 5))); };
    const auto speed_at = [&](double u) {
      const double x = std::clamp(u / 8, 0.0, 1.0);
      return speed * x * x * x * (10 - 15 * x + 6 * x * x);
    };
    const double u = t - kRest;
    if (u > 0) {
      if (u < last_) {
        last_ = 0;
        sum_.setZero();
      }
      const auto way = [&](double v) {
        return Eigen::Vector3d(speed_at(v) * std::cos(yaw_at(v)), speed_at(v) * std::sin(yaw_at(v)), 0);
      };
      while (last_ + kStep <= u) {
        sum_ += kStep / 6 * (way(last_) + 4 * way(last_ + kStep / 2) + way(last_ + kStep));
        last_ += kStep;
      }
      const double rest = u - last_;
      position = sum_ + rest / 6 * (way(last_) + 4 * way(last_ + rest / 2) + way(u));
      constexpr double h = 1e-4;
      state.velocity = way(u);
      state.acceleration = (way(u + h) - way(u - h)) / (2 * h);
      state.angular_velocity.z() = (yaw_at(u + h) - yaw_at(u - h)) / (2 * h);
    }
    state.position = position;
    state.R_world_body = Eigen::AngleAxisd(yaw_at(u), Eigen::Vector3d::UnitZ());
    return state;
  }

 private:
  mutable double last_ = 0;
  mutable Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
};

NavigationLog weave(double speed, double duration, std::uint64_t seed = 3) {
  const Weave flight(speed);
  NavigationLog log;
  simulation::Imu imu(simulation::ImuModel::industrial(), seed);
  simulation::Gnss gnss(simulation::GnssModel{}, seed + 1);
  for (int i = 0; i < static_cast<int>(200 * duration); ++i) {
    const auto state = flight.at(i / 200.0);
    log.imu.push_back(imu.sample(state));
    log.truth.push_back({state.time, {state.R_world_body, state.position}, state.velocity});
    if (i % 40 != 0) continue;
    const auto epoch = gnss.sample(state);
    log.gnss.fixes.push_back(epoch.fix);
    log.gnss.velocities.push_back(epoch.velocity);
  }
  return log;
}

template <class Items>
void drop(Items& items, double from, double to) {
  std::erase_if(items, [&](const auto& item) {
    return item.time > Time::from_seconds(from) && item.time < Time::from_seconds(to);
  });
}

NavigationRun run(const NavigationLog& log, double heading = 0.5) {
  NavigationRunOptions options;
  options.heading = Heading{Time::from_seconds(1), heading, 0.03};
  return run_navigation(log, options);
}

/// Seconds, of a run at ten frames in each.
double seconds_lost(const NavigationRun& run) { return 0.1 * static_cast<double>(run.health.frames_lost); }

double largest_error(const NavigationRun& run, const NavigationLog& log, double from) {
  double largest = 0;
  for (const NavigationFrame& frame : run.frames) {
    if (frame.time < Time::from_seconds(from)) continue;
    const auto truth = std::lower_bound(log.truth.begin(), log.truth.end(), frame.time,
                                        [](const auto& t, Time time) { return t.time < time; });
    if (truth == log.truth.end()) break;
    largest = std::max(
        largest, (frame.pose.T_world_body.translation - truth->T_world_body.translation).head<2>().norm());
  }
  return largest;
}

TEST(Outage, InATurnIsNoContradictionOfPositionsAndVelocities) {
  for (const double speed : {2.0, 10.0}) {
    for (const double length : {8.0, 12.0}) {
      NavigationLog log = weave(speed, 60);
      drop(log.gnss.fixes, 30, 30 + length);
      drop(log.gnss.velocities, 30, 30 + length);
      const NavigationRun result = run(log);
      EXPECT_LT(seconds_lost(result), 3) << speed << " m/s, " << length << " s";
      EXPECT_LT(largest_error(result, log, 50), 6) << speed << " m/s, " << length << " s";
    }
  }
}

TEST(Outage, OfTheVelocitiesAloneLeavesThePositionsInUse) {
  NavigationLog log = weave(10, 80);
  drop(log.gnss.velocities, 30, 1e6);
  const NavigationRun result = run(log);
  EXPECT_LT(seconds_lost(result), 3);
  EXPECT_LT(largest_error(result, log, 45), 8);
}

TEST(Start, WithABarometerBeforeAnyFixStaysWhereItIs) {
  NavigationLog log = weave(0, 40);
  drop(log.gnss.fixes, -1, 25);
  drop(log.gnss.velocities, -1, 25);
  for (int i = 0; i < 400; ++i)
    log.barometer.push_back({Time::from_seconds(0.1 * i), 500 + 0.3 * std::sin(7.0 * i), 0.3});
  const NavigationRun result = run(log);
  ASSERT_GT(result.frames.size(), 300U);
  EXPECT_LT(largest_error(result, log, 0), 40);  // what the accelerometers' biases make of 25 s, and no more
}

TEST(Barometer, OfHeightAboveTheSeaKeepsTheHeightWithoutGnss) {
  NavigationLog log = weave(3, 140);
  drop(log.gnss.fixes, 60, 1e6);
  drop(log.gnss.velocities, 60, 1e6);
  for (int i = 0; i < 1400; ++i)
    log.barometer.push_back({Time::from_seconds(0.1 * i), 1600 + 0.3 * std::sin(7.0 * i), 0.3});
  const NavigationRun result = run(log);
  EXPECT_LT(std::abs(result.frames.back().pose.T_world_body.translation.z()), 8);
}

TEST(Measurements, OfTheFutureAreCountedAndDoNotCrowdOutTheOthers) {
  const NavigationLog log = weave(5, 40);
  Navigator navigator({});
  navigator.add(Heading{Time::from_seconds(1), 0.5, 0.03});
  for (int i = 0; i < 20000; ++i)
    navigator.add(
        BarometricHeight{Time::from_seconds(1000 + 0.01 * i), 5, 0.3});  // before any IMU sample, and
  std::size_t epoch = 0;
  for (const ImuSample& sample : log.imu) {
    navigator.add(sample);
    for (; epoch < log.gnss.fixes.size() && log.gnss.fixes[epoch].time <= sample.time; ++epoch) {
      GnssFix fix = log.gnss.fixes[epoch];
      GnssVelocity velocity = log.gnss.velocities[epoch];
      const bool wrong = fix.time < Time::from_seconds(20);  // a clock that is an hour ahead, and set at 20 s
      for (Time* time : {&fix.time, &velocity.time}) time->nanoseconds += wrong ? 3'600'000'000'000 : 0;
      navigator.add(fix);
      navigator.add(velocity);
    }
  }
  const Health health = navigator.health();
  EXPECT_GE(health.too_new, 100U);
  EXPECT_LT(health.seconds_since_position, 1);
  EXPECT_LT(health.seconds_since_velocity, 1);
}

TEST(Frames, StayOutOfAClockThatWasSet) {
  NavigationLog log = weave(2, 20);
  for (ImuSample& sample : log.imu) {
    if (sample.time > Time::from_seconds(10)) sample.time.nanoseconds += 1'700'000'000'000'000'000;
  }
  const NavigationRun result = run(log);
  EXPECT_LT(result.health.frames + result.health.frames_without_answer, 500U);
}

TEST(Gap, LeavesTheSameDoubtHoweverManyMeasurementsFallIntoIt) {
  const auto doubt = [](int measurements) {
    FilterOptions options;
    Filter filter(options, Vector3d::Zero());
    NavigationState state;
    filter.start(state, BaseMatrix::Identity() * 1e-6);
    for (int i = 0; i < measurements; ++i)
      filter.add_gap_noise(0.8 * i / measurements, 0.8 * (i + 1) / measurements);
    return BaseMatrix(filter.covariance());
  };
  const BaseMatrix once = doubt(1);
  EXPECT_LT((doubt(40) - once).norm(), 1e-9 * once.norm());
  EXPECT_GT(once(kPhi, kPhi), 1e-3);
}

TEST(Heading, IsUsedByAStartInMotionAndByARestThatComesLater) {
  // In motion from the first sample on.
  NavigationLog moving = weave(6, 60);
  std::erase_if(moving.imu, [](const ImuSample& s) { return s.time < Time::from_seconds(16); });
  drop(moving.gnss.fixes, -1, 16);
  drop(moving.gnss.velocities, -1, 16);
  const Weave flight(6);
  const auto yaw_of_body = [](const Eigen::Quaterniond& R) {
    const Eigen::Vector3d x = R * Eigen::Vector3d::UnitX();
    return std::atan2(x.y(), x.x());
  };
  NavigationRunOptions options;
  options.heading = Heading{Time::from_seconds(17), yaw_of_body(flight.at(17).R_world_body), 0.02};
  const NavigationRun told = run_navigation(moving, options);
  ASSERT_FALSE(told.frames.empty());
  const NavigationFrame& first = told.frames.front();
  const double error = std::remainder(yaw_of_body(first.pose.T_world_body.rotation) -
                                          yaw_of_body(flight.at(first.time.seconds()).R_world_body),
                                      2 * 3.14159265358979);
  EXPECT_LT(std::abs(error), 0.06);
  options.heading.reset();
  const NavigationRun untold = run_navigation(moving, options);
  EXPECT_TRUE(untold.frames.empty() || untold.frames.front().time > first.time);
}

}  // namespace
}  // namespace pade::navigation
