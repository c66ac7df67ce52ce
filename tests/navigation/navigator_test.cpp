#include "pade/navigation/navigator.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "pade/navigation/replay.hpp"
#include "pade/paper/navigation_protocol.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

using simulation::GnssModel;
using simulation::ImuModel;

constexpr double kDegree = std::numbers::pi / 180;

Time at(double seconds) { return Time::from_seconds(seconds); }

NavigatorOptions options() {
  NavigatorOptions options;
  options.gnss_lever_arm = {0.1, 0, 0.08};
  return options;
}

GnssModel single_point() {
  GnssModel model;
  model.lever_arm = {0.1, 0, 0.08};
  return model;
}

NavigationProtocol protocol() {
  NavigationProtocol protocol;
  protocol.start = 0;
  protocol.score_from = 15;
  return protocol;
}

/// A short flight that most tests share.
const NavigationLog& flight() {
  static const NavigationLog log = record(Flight{}, 40, ImuModel::industrial(), single_point(), 1);
  return log;
}

/// Everything that the navigator says about a flight, asked at 10 Hz and `delay` after the fact.
std::vector<RelativePose> answers(const NavigationLog& log, const ReplayOptions& replay_options, double delay,
                                  double until = 1e9) {
  Navigator navigator(options());
  std::vector<RelativePose> result;
  double next = 10;
  replay(log, navigator, replay_options, [&](Time now) {
    while (next <= until && at(next + delay) <= now) {
      result.push_back(navigator.relative_pose(at(next - 0.1), at(next), Pose{}));
      next += 0.1;
    }
  });
  return result;
}

ReplayOptions with_heading() {
  ReplayOptions replay;
  replay.headings.push_back({at(1), 0.7, 2 * kDegree});
  return replay;
}

void expect_same(const std::vector<RelativePose>& a, const std::vector<RelativePose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].answer, Answer::valid) << i;
    ASSERT_EQ(a[i].motion.t_reference_other, b[i].motion.t_reference_other) << i;
    ASSERT_EQ(a[i].motion.R_reference_other, b[i].motion.R_reference_other) << i;
    ASSERT_EQ(a[i].motion.covariance, b[i].motion.covariance) << i;
  }
}

TEST(Navigator, GivesTheSameBitsTwice) {
  expect_same(answers(flight(), with_heading(), 0), answers(flight(), with_heading(), 0));
}

TEST(Navigator, LateAndOvertakingGnssEndsInTheSameBitsAsPunctualGnss) {
  ReplayOptions late = with_heading();
  late.gnss_delay_high = 0.3;
  late.seed = 3;
  expect_same(answers(flight(), with_heading(), 0.4), answers(flight(), late, 0.4));
}

TEST(Navigator, UsesNothingStampedAfterTheSecondFrame) {
  // Everything behind t2 = 20.05 is replaced by nonsense; the question comes late.
  NavigationLog changed = flight();
  for (auto& sample : changed.imu) {
    if (sample.time > at(20.05)) sample.angular_rate += Eigen::Vector3d(1, -2, 3);
  }
  for (auto& fix : changed.gnss.fixes) {
    if (fix.time > at(20.05)) fix.position.x() += 3;
  }
  for (auto& velocity : changed.gnss.velocities) {
    if (velocity.time > at(20.05)) velocity.velocity.x() += 0.2;
  }
  for (const double t2 : {20.05, 20.0475}) {  // on an IMU stamp, and between two
    RelativePose result[2];
    for (int k = 0; k < 2; ++k) {
      Navigator navigator(options());
      replay(k == 0 ? flight() : changed, navigator, with_heading(), [&](Time now) {
        if (now == at(20.4)) result[k] = navigator.relative_pose(at(19.9), at(t2), Pose{});
      });
    }
    ASSERT_EQ(result[0].answer, Answer::valid);
    EXPECT_EQ(result[0].motion.t_reference_other, result[1].motion.t_reference_other);
    EXPECT_EQ(result[0].motion.covariance, result[1].motion.covariance);
  }
}

class Flights : public testing::TestWithParam<int> {};

TEST_P(Flights, ErrorsOfTheRelativeMotionAreAsLargeAsTheirCovarianceSays) {
  const bool consumer = GetParam() == 1;
  NavigatorOptions constants = options();
  if (consumer) constants.filter = FilterOptions::of(ImuClass::consumer);
  double nees = 0;
  double rotation = 0;
  const int flights = 3;
  for (int seed = 1; seed <= flights; ++seed) {
    const auto log = record(Flight{}, 60, consumer ? ImuModel::consumer() : ImuModel::industrial(),
                            single_point(), static_cast<std::uint64_t>(10 * seed));
    const auto figures = run_protocol(log, constants, protocol());
    EXPECT_TRUE(figures.finite);
    EXPECT_GT(figures.short_pairs.pairs, 400U);
    nees += figures.short_pairs.nees_mean / flights;
    rotation = std::max(rotation, figures.short_pairs.rotation_95);
    EXPECT_LT(figures.short_pairs.translation_95, consumer ? 0.016 : 0.011);
  }
  // The constants allow for real vibration, so a simulated flight is a little better than they promise.
  EXPECT_GT(nees, 0.8);
  EXPECT_LT(nees, 4.5);
  EXPECT_LT(rotation, (consumer ? 0.05 : 0.03) * kDegree);
}
INSTANTIATE_TEST_SUITE_P(Imus, Flights, testing::Values(0, 1), [](const auto& parameter) {
  return parameter.param == 0 ? "Industrial" : "Consumer";
});

TEST(Navigator, FindsItsYawInFlightWithinTenSeconds) {
  for (int seed = 1; seed <= 4; ++seed) {
    Flight in_motion;
    in_motion.rest = -10.0 * seed;  // at full speed at time zero
    const auto log =
        record(in_motion, 40, ImuModel::industrial(), single_point(), static_cast<std::uint64_t>(seed));
    auto p = protocol();
    p.heading_given = false;
    const auto figures = run_protocol(log, options(), p);
    EXPECT_LT(figures.aligned.seconds(), 10) << "seed " << seed;
    EXPECT_GT(figures.aligned.seconds(), 0) << "seed " << seed;
    EXPECT_LT(std::abs(figures.yaw_error_aligned), 0.25)
        << "two of the sigmas that it begins with, seed " << seed;
  }
}

TEST(Navigator, RelativePoseOfTheCameraFollowsFromItsMounting) {
  const Pose T_body_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.2, 0.05, -0.1}};
  Navigator navigator(options());
  RelativePose body;
  RelativePose camera;
  replay(flight(), navigator, with_heading(), [&](Time now) {
    if (now != at(20)) return;
    body = navigator.relative_pose(at(19.7), at(20), Pose{});
    camera = navigator.relative_pose(at(19.7), at(20), T_body_camera);
  });
  const Pose T_body{Quaterniond(body.motion.R_reference_other), body.motion.t_reference_other};
  const Pose expected = T_body_camera.inverse() * T_body * T_body_camera;
  EXPECT_LT((camera.motion.t_reference_other - expected.translation).norm(), 1e-12);
  EXPECT_LT((camera.motion.R_reference_other - expected.matrix3()).norm(), 1e-12);
  // Rotation is as well known as the body's, only seen in other axes.
  EXPECT_NEAR((camera.motion.covariance.bottomRightCorner<3, 3>().trace()),
              (body.motion.covariance.bottomRightCorner<3, 3>().trace()), 1e-15);
}

TEST(Navigator, ATimeOffsetOfTheCameraShiftsTheQuestion) {
  NavigatorOptions shifted = options();
  shifted.camera_time_offset = -0.25;
  Navigator plain(options());
  Navigator offset(shifted);
  RelativePose a;
  RelativePose b;
  replay(flight(), plain, with_heading(), [&](Time now) {
    if (now == at(20.5)) a = plain.relative_pose(at(19.75), at(20), Pose{});
  });
  replay(flight(), offset, with_heading(), [&](Time now) {
    if (now == at(20.5)) b = offset.relative_pose(at(20), at(20.25), Pose{});
  });
  EXPECT_EQ(a.motion.t_reference_other, b.motion.t_reference_other);
}

TEST(Navigator, GoesThroughItsStatesAndFallsBackToDeadReckoning) {
  NavigationLog log = flight();
  std::erase_if(log.gnss.fixes, [](const auto& m) { return m.time > at(25); });
  std::erase_if(log.gnss.velocities, [](const auto& m) { return m.time > at(25); });
  Navigator navigator(options());
  std::vector<NavigationStatus> seen;
  bool valid_scale_late = false;
  replay(log, navigator, with_heading(), [&](Time now) {
    const Health health = navigator.health();
    if (seen.empty() || seen.back() != health.status) seen.push_back(health.status);
    if (now == at(39)) {
      EXPECT_NEAR(health.seconds_since_velocity, 14, 0.3);
      valid_scale_late = navigator.relative_pose(at(38.9), at(39), Pose{}).scale_valid;
    }
  });
  EXPECT_EQ(seen, (std::vector{NavigationStatus::uninitialised, NavigationStatus::navigating,
                               NavigationStatus::dead_reckoning}));
  EXPECT_FALSE(valid_scale_late) << "14 s without GNSS";
}

TEST(Navigator, SaysWhyItCannotAnswer) {
  Navigator navigator(options());
  EXPECT_EQ(navigator.relative_pose(at(1), at(2), Pose{}).answer, Answer::not_initialised);
  replay(flight(), navigator, with_heading(), [&](Time now) {
    if (now == at(1)) {
      EXPECT_EQ(navigator.absolute_pose(now).answer, Answer::not_initialised);
    }
    if (now != at(20)) return;
    EXPECT_EQ(navigator.relative_pose(at(19.9), at(20.1), Pose{}).answer, Answer::too_new);
    EXPECT_EQ(navigator.relative_pose(at(12), at(20), Pose{}).answer, Answer::too_old);
    EXPECT_EQ(navigator.relative_pose(at(19.5), at(20), Pose{}).answer, Answer::valid)
        << "half a second of history";
  });
}

TEST(Navigator, SurvivesBadInputAndCountsIt) {
  NavigationLog log = flight();
  log.imu[3000].specific_force.x() = std::nan("");
  log.imu[3001].time = log.imu[3000].time;
  log.imu[3101].time = at(log.imu[3100].time.seconds() - 1);
  log.imu[3201].angular_rate.setConstant(1e6);  // saturated, to say the least
  log.gnss.fixes[60].covariance.setZero();
  log.gnss.fixes[61].position.x() = std::nan("");
  log.gnss.velocities[62].covariance.setConstant(std::nan(""));
  log.gnss.fixes.push_back(log.gnss.fixes.back());
  log.imu.erase(log.imu.begin() + 4000, log.imu.begin() + 4170);  // 850 ms
  Navigator navigator(options());
  bool finite = true;
  bool valid_in_gap = true;
  replay(log, navigator, with_heading(), [&](Time now) {
    const AbsolutePose pose = navigator.absolute_pose(now);
    if (pose.answer != Answer::valid) return;
    finite = finite && pose.T_world_body.is_finite() && pose.covariance.allFinite();
    if (now == log.imu[4000].time) {
      valid_in_gap = navigator.relative_pose(at(now.seconds() - 0.1), now, Pose{}).scale_valid;
    }
  });
  const Health health = navigator.health();
  EXPECT_TRUE(finite);
  EXPECT_FALSE(valid_in_gap);
  EXPECT_EQ(health.imu_refused, 2U);  // NaN, reversed; the repeated stamp follows the refused one
  EXPECT_EQ(health.imu_gaps, 1U);
  EXPECT_EQ(health.unusable, 2U);
  EXPECT_EQ(health.duplicates, 1U);
  EXPECT_EQ(health.status, NavigationStatus::navigating);
}

TEST(Navigator, StartsAnewAfterAGapTooLongToBridge) {
  NavigationLog log = flight();
  std::erase_if(log.imu, [](const auto& s) { return s.time > at(15) && s.time < at(20); });
  Navigator navigator(options());
  replay(log, navigator, with_heading(), nullptr);
  EXPECT_EQ(navigator.health().restarts, 1U);
}

TEST(Navigator, BarometerAndMagnetometerCarryHeightAndYawThroughAnOutage) {
  const Flight path{.rest = 4, .speed = 1};
  NavigationLog log = record(path, 70, ImuModel::industrial(), single_point(), 5);
  std::erase_if(log.gnss.fixes, [](const auto& m) { return m.time > at(40); });
  std::erase_if(log.gnss.velocities, [](const auto& m) { return m.time > at(40); });
  simulation::Barometer barometer({}, 3);
  simulation::MagnetometerModel field;
  field.hard_iron = 0;
  simulation::Magnetometer magnetometer(field, 4);
  for (double t = 0; t < 70; t += 0.1) {
    log.barometer.push_back(barometer.sample(path.at(t)));
    log.magnetometer.push_back(magnetometer.sample(path.at(t)));
  }
  Navigator navigator(options());
  AbsolutePose end;
  replay(log, navigator, ReplayOptions{}, [&](Time now) { end = navigator.absolute_pose(now); });
  const auto truth = path.at(end.answer == Answer::valid ? navigator.newest().seconds() : 0);
  EXPECT_LT(std::abs(end.T_world_body.translation.z() - truth.position.z()), 3.5);
  const Quaterniond difference = end.T_world_body.rotation * truth.R_world_body.conjugate();
  EXPECT_LT(std::abs(rotation_log(difference).z()), 5 * kDegree);
}

TEST(Navigator, TellsADoubtfulDirectionFromADoubtfulLength) {
  // A vehicle that flies straight on learns nothing of its yaw: the GNSS gives the length alone.
  NavigationLog log;
  simulation::Imu imu(ImuModel::industrial(), 7);
  simulation::Gnss gnss({}, 8);
  for (int i = 0; i < 200 * 8; ++i) {
    simulation::KinematicState state;
    state.time = at(i / 200.0);
    state.velocity = {2, 0, 0};
    state.position = {2 * i / 200.0, 0, 0};
    log.imu.push_back(imu.sample(state));
    if (i % 40 != 0) continue;
    const auto epoch = gnss.sample(state);
    log.gnss.fixes.push_back(epoch.fix);
    log.gnss.velocities.push_back(epoch.velocity);
  }
  const auto answer = [&](double heading_sigma, double last_heading) {
    Navigator navigator(NavigatorOptions{});
    ReplayOptions replay_options;
    for (double t = 2; t <= last_heading; t += 1)
      replay_options.headings.push_back({at(t), 0, heading_sigma});
    RelativePose result;
    replay(log, navigator, replay_options, [&](Time now) {
      if (now == at(7)) result = navigator.relative_pose(at(6.9), at(7), Pose{});
    });
    EXPECT_EQ(result.answer, Answer::valid);
    return result;
  };
  const RelativePose doubtful = answer(0.2, 3);
  const RelativePose known = answer(0.03, 7);
  EXPECT_TRUE(doubtful.scale_valid);
  EXPECT_FALSE(doubtful.direction_valid);
  EXPECT_EQ(doubtful.status, NavigationStatus::levelled);
  EXPECT_TRUE(known.scale_valid);
  EXPECT_TRUE(known.direction_valid);
}

TEST(Navigator, LearnsTheGyroscopeBiasFromACompassWithIronWithinSeconds) {
  double nees = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    NavigationLog log;
    simulation::Imu imu(ImuModel::industrial(), seed);
    simulation::Gnss gnss({}, seed + 100);
    simulation::Magnetometer compass({}, seed + 200);
    for (int i = 0; i <= 200 * 6; ++i) {
      simulation::KinematicState state;
      state.time = at(i / 200.0);
      state.velocity = {2, 0, 0};
      state.position = {2 * i / 200.0, 0, 0};
      log.imu.push_back(imu.sample(state));
      if (i % 10 == 0) log.magnetometer.push_back(compass.sample(state));
      if (i % 40 != 0) continue;
      const auto epoch = gnss.sample(state);
      log.gnss.fixes.push_back(epoch.fix);
      log.gnss.velocities.push_back(epoch.velocity);
    }
    for (MagneticField& m : log.magnetometer) m.sigma = MagneticField{}.sigma;  // as a log has it
    Navigator navigator(NavigatorOptions{});
    AbsolutePose end;
    RelativePose motion;
    replay(log, navigator, {}, [&](Time now) {
      if (now != at(6)) return;
      end = navigator.absolute_pose(now);
      motion = navigator.relative_pose(at(5.9), now, Pose{});
    });
    ASSERT_EQ(end.answer, Answer::valid) << "seed " << seed;
    const Vector3d error = end.gyroscope_bias - imu.gyroscope_bias();
    EXPECT_LT(error.norm(), 0.012) << "seed " << seed;  // 0.5 °/s per axis when switched on
    const Vector3d turn = rotation_log(motion.motion.R_reference_other);
    nees += turn.dot(motion.motion.covariance.bottomRightCorner<3, 3>().ldlt().solve(turn)) / 20;
  }
  EXPECT_GT(nees, 1.5);
  EXPECT_LT(nees, 5);
}

}  // namespace
}  // namespace pade::navigation
