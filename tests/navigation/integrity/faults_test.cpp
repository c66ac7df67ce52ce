// Faults of the sensors in flight: the navigator says that it is lost, and finds back.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/evaluation/navigation_score.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/replay.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFault = 20;  // s

Time at(double seconds) { return Time::from_seconds(seconds); }

const NavigationLog& flight() {
  static const NavigationLog log =
      record(Flight{}, 50, simulation::ImuModel::industrial(), simulation::GnssModel::single_point(), 11);
  return log;
}

struct Outcome {
  double noticed = 1e9;        ///< s after the fault
  double nees = 0;             ///< mean of the translation from 15 s after it on
  double valid = 0;            ///< share of `scale_valid` in that time
  double wrong_and_valid = 0;  ///< share of flagged pairs whose length is over 20 % wrong, from the fault on
  Health health;
};

/// Flies with a fault, asks for the motion over 0.1 s ten times a second.
Outcome fly(const std::function<void(NavigationLog&)>& spoil, double heading_rate = 0,
            const NavigationLog& clean = flight()) {
  NavigationLog log = clean;
  spoil(log);
  Navigator navigator(NavigatorOptions{});
  ReplayOptions replay_options;
  Random random(5);
  const auto yaw = [&](double t) {
    const Vector3d x = evaluation::truth_at(clean.truth, at(t))->T_world_body.rotation * Vector3d::UnitX();
    return std::atan2(x.y(), x.x());
  };
  replay_options.headings.push_back({at(1), yaw(1) + 2 * kDegree * random.normal(), 2 * kDegree});
  for (double t = 3; heading_rate > 0 && t < 49; t += 1 / heading_rate) {
    replay_options.headings.push_back({at(t), yaw(t) + 2 * kDegree * random.normal(), 2 * kDegree});
  }
  Outcome outcome;
  double pairs = 0;
  double flagged = 0;
  double next = 10;
  replay(log, navigator, replay_options, [&](Time now) {
    if (now < at(next)) return;
    const double t = next;
    next += 0.1;
    const auto answer = navigator.relative_pose(at(t - 0.1), at(t), Pose{});
    const double since = t - kFault;
    if (since > 0 && answer.status != NavigationStatus::navigating) {
      outcome.noticed = std::min(outcome.noticed, since);
    }
    if (answer.answer != Answer::valid) return;
    if (answer.status == NavigationStatus::lost) {
      EXPECT_FALSE(answer.scale_valid || answer.direction_valid) << t;
    }
    const auto error = evaluation::score(
        {at(t - 0.1), at(t), answer.motion, answer.scale_valid, answer.direction_valid}, clean.truth);
    if (!error || since < 0) return;
    flagged += answer.scale_valid;
    outcome.wrong_and_valid += answer.scale_valid && error->length > 0.2 * error->baseline;
    if (since < 15) return;
    outcome.nees += error->nees;
    outcome.valid += answer.scale_valid;
    ++pairs;
  });
  outcome.nees /= pairs;
  outcome.valid /= pairs;
  outcome.wrong_and_valid /= std::max(flagged, 1.0);
  outcome.health = navigator.health();
  return outcome;
}

std::function<void(NavigationLog&)> inertial_fault(const Vector3d& rate, const Vector3d& force) {
  return [=](NavigationLog& log) {
    for (ImuSample& sample : log.imu) {
      if (sample.time <= at(kFault)) continue;
      sample.angular_rate += rate;
      sample.specific_force += force;
    }
  };
}

TEST(Faults, AFlightWithoutOneIsNeverLost) {
  for (std::uint64_t seed = 21; seed <= 25; ++seed) {
    const auto log =
        record(Flight{}, 50, simulation::ImuModel::consumer(), simulation::GnssModel::single_point(), seed);
    const Outcome outcome = fly([](NavigationLog&) {}, seed % 2 == 0 ? 5 : 0, log);
    EXPECT_EQ(outcome.health.times_lost, 0U) << "seed " << seed;
    EXPECT_EQ(outcome.health.velocity_doubted, 0U);
    EXPECT_GT(outcome.noticed, 100);
  }
}

class GyroscopeSteps : public testing::TestWithParam<std::pair<int, double>> {};

TEST_P(GyroscopeSteps, AreNoticedAndOvercome) {
  const auto [axis, size] = GetParam();
  const bool yaw = axis == 2;
  const Outcome outcome = fly(inertial_fault(size * Vector3d::Unit(axis), Vector3d::Zero()), yaw ? 5 : 0);
  const bool slow = std::abs(size) < 0.02;  // no innovation leaves its gate: their drift tells
  EXPECT_LT(outcome.noticed, yaw ? 15 : slow ? 8 : 3.05);
  EXPECT_LT(outcome.nees, 5);
  EXPECT_GT(outcome.valid, 0.5) << "and then its answers are of use again";
  EXPECT_GE(outcome.health.times_lost, 1U);
}
INSTANTIATE_TEST_SUITE_P(Axes, GyroscopeSteps,
                         testing::Values(std::pair{0, 0.008}, std::pair{0, 0.02}, std::pair{0, -0.05},
                                         std::pair{1, 0.02}, std::pair{1, 0.1}, std::pair{2, 0.02},
                                         std::pair{2, -0.05}));

TEST(Faults, StepsOfAnAccelerometerAreNoticedAndOvercome) {
  for (int axis = 0; axis < 3; ++axis) {
    const Outcome outcome = fly(inertial_fault(Vector3d::Zero(), Vector3d::Unit(axis)));
    EXPECT_LT(outcome.noticed, 3.05) << axis;
    EXPECT_LT(outcome.nees, 5) << axis;
  }
}

TEST(Faults, VelocitiesThatContradictThePositionsAreNotFollowed) {
  for (const double size : {0.7, 2.0, 7.5}) {
    const Outcome outcome = fly([size](NavigationLog& log) {
      for (GnssVelocity& v : log.gnss.velocities) {
        if (v.time > at(kFault)) v.velocity.x() += size;
      }
    });
    EXPECT_LT(outcome.noticed, 3.05) << size;
    EXPECT_GE(outcome.health.velocity_doubted, 1U) << size;
    EXPECT_LT(outcome.nees, 5) << size;
    EXPECT_NE(outcome.health.status, NavigationStatus::navigating);
  }
}

TEST(Faults, PositionsThatDriftAwayAreNoticedAndLeaveTheMotionAlone) {
  const Outcome outcome = fly([](NavigationLog& log) {
    for (GnssFix& fix : log.gnss.fixes) fix.position.y() += 3 * std::max(0.0, fix.time.seconds() - kFault);
  });
  EXPECT_LT(outcome.noticed, 3.05);
  EXPECT_LT(outcome.nees, 5);
  EXPECT_EQ(outcome.health.velocity_doubted, 0U);
  EXPECT_EQ(outcome.health.restarts, 0U);
}

TEST(Faults, AFilterThatStaysLostStartsAnew) {
  // The gyroscopes show nonsense until 12 s later: no bias explains it.
  const auto nonsense = [](NavigationLog& log) {
    for (ImuSample& sample : log.imu) {
      const double since = sample.time.seconds() - kFault;
      if (since > 0 && since < 12)
        sample.angular_rate += 2 * Vector3d(std::sin(since), std::cos(1.7 * since), 1);
    }
  };
  const Outcome outcome = fly(nonsense, 5);
  EXPECT_LT(outcome.noticed, 3.05);
  EXPECT_GE(outcome.health.restarts_when_lost, 1U);
  EXPECT_EQ(outcome.health.restarts, outcome.health.restarts_when_lost);
  EXPECT_EQ(outcome.health.status, NavigationStatus::navigating) << "with a yaw found in flight";
}

TEST(Faults, BeingLostDoesNotDependOnWhenTheDataCame) {
  NavigationLog log = flight();
  inertial_fault({0.2, 0, 0}, Vector3d::Zero())(log);
  std::vector<RelativePose> answers[2];
  for (int k = 0; k < 2; ++k) {
    Navigator navigator(NavigatorOptions{});
    ReplayOptions replay_options;
    replay_options.headings.push_back({at(1), 0.7, 2 * kDegree});
    replay_options.gnss_delay_high = k == 0 ? 0 : 0.3;
    double next = 10;
    replay(log, navigator, replay_options, [&](Time now) {
      for (; at(next + 0.35) <= now; next += 0.1) {
        answers[k].push_back(navigator.relative_pose(at(next - 0.1), at(next), Pose{}));
      }
    });
  }
  ASSERT_EQ(answers[0].size(), answers[1].size());
  bool lost = false;
  for (std::size_t i = 0; i < answers[0].size(); ++i) {
    EXPECT_EQ(answers[0][i].status, answers[1][i].status) << i;
    EXPECT_EQ(answers[0][i].motion.covariance, answers[1][i].motion.covariance) << i;
    lost = lost || answers[0][i].status == NavigationStatus::lost;
  }
  EXPECT_TRUE(lost);
}

/// A receiver of course and speed over ground alone, on a vehicle that climbs at 2 m/s between other flight:
/// its velocities are no contradiction of its positions.
TEST(IntegrityInFlight, AClimbThatTheVelocitiesDoNotMeasureIsNoFault) {
  constexpr double kFrom = 20, kFor = 12, kSpeed = 2;  // s, s, m/s
  const auto climb = [](double t) {   // height, its rate and its acceleration; fading in and out over 1 s
    const auto ramp = [](double s) {  // a smooth step, its integral from 0 on, and its derivative
      const double u = std::clamp(s, 0.0, 1.0);
      const double past = std::max(0.0, s - 1);
      return std::array{3 * u * u - 2 * u * u * u, u * u * u - 0.5 * u * u * u * u + past, 6 * u - 6 * u * u};
    };
    const auto up = ramp(t - kFrom), down = ramp(t - kFrom - kFor);
    return Vector3d(kSpeed * (up[1] - down[1]), kSpeed * (up[0] - down[0]), kSpeed * (up[2] - down[2]));
  };
  NavigationLog log;
  simulation::Imu imu(simulation::ImuModel::industrial(), 3);
  simulation::Gnss gnss(simulation::GnssModel::single_point(), 4);
  for (int i = 0; i < 200 * 50; ++i) {
    auto state = Flight{}.at(i / 200.0);
    const Vector3d rise = climb(i / 200.0);
    state.position.z() += rise[0];
    state.velocity.z() += rise[1];
    state.acceleration.z() += rise[2];
    log.imu.push_back(imu.sample(state));
    log.truth.push_back({state.time, {state.R_world_body, state.position}, state.velocity});
    if (i % 10 == 0) log.barometer.push_back({state.time, state.position.z(), 0.3});
    if (i % 40 != 0) continue;
    auto epoch = gnss.sample(state);
    epoch.velocity.velocity.z() = 0;
    epoch.velocity.covariance(2, 2) = 100;
    log.gnss.fixes.push_back(epoch.fix);
    log.gnss.velocities.push_back(epoch.velocity);
  }
  const Outcome outcome = fly([](NavigationLog&) {}, 0, log);
  EXPECT_EQ(outcome.health.velocity_doubted, 0U);
  EXPECT_EQ(outcome.health.times_lost, 0U);
  EXPECT_EQ(outcome.health.restarts, 0U);
  EXPECT_GT(outcome.noticed, 1e8) << "navigating all the time";
}

/// A filter that starts in a smooth cruise, with velocities that have no climb: that is no rest.
TEST(IntegrityInFlight, ACruiseIsNotTakenForRest) {
  simulation::Imu imu(simulation::ImuModel::industrial(), 3);
  simulation::Gnss gnss(simulation::GnssModel::single_point(), 4);
  Navigator navigator(NavigatorOptions{});
  int answers = 0;
  for (int i = 0; i < 200 * 15; ++i) {
    simulation::KinematicState state;
    state.time = at(i / 200.0);
    state.R_world_body = Eigen::AngleAxisd(0.4, Vector3d::UnitZ());
    state.velocity = Vector3d(12, 9, 0);
    state.position = i / 200.0 * state.velocity;
    navigator.add(imu.sample(state));
    if (i % 10 == 0) {
      const Vector3d field(0, 0.2, -0.4);
      navigator.add(MagneticField{state.time, state.R_world_body.conjugate() * field, 0.02});
    }
    if (i % 40 != 0) continue;
    auto epoch = gnss.sample(state);
    epoch.velocity.covariance(2, 2) = 100;
    navigator.add(epoch.fix);
    navigator.add(epoch.velocity);
    const AbsolutePose pose = navigator.absolute_pose(state.time);
    if (pose.answer != Answer::valid) continue;
    ++answers;
    EXPECT_GT(pose.velocity.norm(), 10) << state.time.seconds();
  }
  EXPECT_GT(answers, 20);
  EXPECT_EQ(navigator.health().times_lost, 0U);
}

}  // namespace
}  // namespace pade::navigation
