// Motions between images in the filter: its models against differences, what it makes of draws whose noise is
// as stated, and what it does with those that come late, lie, or are not asked for.
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/evaluation/navigation_score.hpp"
#include "pade/navigation/camera/camera_models.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/replay.hpp"
#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/flight/sensor_suite.hpp"

#include "navigation/numeric_jacobian.hpp"

namespace pade::navigation {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Pose forward_camera() { return {Eigen::Quaterniond(forward_camera_rotation()), Vector3d(0.1, 0.02, -0.03)}; }

Pose moved(const Pose& pose, const Vector6d& error) {
  const Vector3d phi = error.head<3>();
  return pose * Pose{rotation_exp(phi), left_jacobian(phi) * error.tail<3>()};
}

TEST(CameraModel, JacobiansAreThoseOfDifferences) {
  Random random(7);
  for (int draw = 0; draw < 20; ++draw) {
    CameraState camera;
    camera.anchor = {rotation_exp(random.normal3()), 5 * random.normal3()};
    camera.mounting = rotation_exp(0.1 * random.normal3());
    const Pose now{rotation_exp(random.normal3()), 5 * random.normal3()};
    const CameraPrediction y = predict_camera_motion(camera, now, forward_camera());
    const auto difference = [&](const CameraPrediction& other) {
      Vector6d d;
      d << other.T_2_1.translation - y.T_2_1.translation,
          rotation_log(Eigen::Quaterniond(other.T_2_1.rotation * y.T_2_1.rotation.conjugate()));
      return d;
    };
    expect_jacobian<6, 6>(y.by_now, [&](const Vector6d& e) {
      return difference(predict_camera_motion(camera, moved(now, e), forward_camera()));
    });
    expect_jacobian<6, 6>(y.by_anchor, [&](const Vector6d& e) {
      CameraState other = camera;
      other.anchor = moved(camera.anchor, e);
      return difference(predict_camera_motion(other, now, forward_camera()));
    });
    expect_jacobian<6, 3>(y.by_mounting, [&](const Vector3d& mu) {
      CameraState other = camera;
      other.mounting = camera.mounting * rotation_exp(mu);
      return difference(predict_camera_motion(other, now, forward_camera()));
    });
  }
}

TEST(CameraModel, ATurnBetweenDirectionsIsAsLongAsItsAngle) {
  const Vector3d forward = Vector3d::UnitX();
  for (const double angle : {0.0, 0.3, 1.5, 3.0, std::numbers::pi}) {
    const Vector3d turn = turn_between(forward, {std::cos(angle), std::sin(angle), 0});
    EXPECT_NEAR(turn.norm(), angle, 1e-9);
    EXPECT_NEAR(turn.x(), 0, 1e-9);
  }
}

/// How the motions between images are made from the truth.
struct CameraNoise {
  double rotation = 0.02;  ///< standard deviation per axis, degrees
  double direction = 0.3;  ///< likewise
  double shared = 0;       ///< share of an image's part in the noise of one motion that the next has
  Vector3d mounting = Vector3d::Zero();  ///< rotation of the true mounting after the calibrated one, degrees
  double claimed = 1;                    ///< σ that is claimed over that drawn
};

/// A flight of config/flights with its sensors.
class Flown {
 public:
  Flown(const std::string& name, std::uint64_t seed, bool compass, double duration = 0)
      : flight_(*simulation::read_flight(std::filesystem::path(PADE_SOURCE_DIR) / "config/flights" /
                                         (name + ".yaml"))),
        path_(*simulation::Trajectory::through(flight_.waypoints, flight_.trajectory)) {
    simulation::SensorSuite sensors(flight_.sensors, seed);
    simulation::SampleClock gnss(flight_.sensors.gnss_rate), barometer(flight_.sensors.baro_rate),
        magnetometer(flight_.sensors.mag_rate);
    if (!(duration > 0)) duration = path_.duration();
    for (int i = 0; i < duration * flight_.sensors.imu_rate; ++i) {
      const double t = i / flight_.sensors.imu_rate;
      const simulation::KinematicState truth = path_.at(t);
      log.imu.push_back(sensors.imu.sample(truth));
      log.truth.push_back({truth.time, {truth.R_world_body, truth.position}, truth.velocity});
      if (gnss.is_due(t)) {
        const auto epoch = sensors.gnss.sample(truth);
        log.gnss.fixes.push_back(epoch.fix);
        log.gnss.velocities.push_back(epoch.velocity);
      }
      if (barometer.is_due(t)) log.barometer.push_back(sensors.barometer.sample(truth));
      if (compass && magnetometer.is_due(t)) log.magnetometer.push_back(sensors.magnetometer.sample(truth));
    }
  }
  [[nodiscard]] Pose body(double t) const {
    const auto state = path_.at(t);
    return {state.R_world_body, state.position};
  }
  [[nodiscard]] double duration() const { return log.imu.back().time.seconds(); }

  NavigationLog log;

 private:
  simulation::Flight flight_;
  simulation::Trajectory path_;
};

/// Motions between neighbouring images of a flight, ten a second.
std::vector<CameraMotion> motions_of(const Flown& flown, const CameraNoise& noise, std::uint64_t seed) {
  Random random(seed);
  std::vector<CameraMotion> motions;
  const auto draw = [&] {
    Vector6d d;
    d << noise.direction * kDegree * random.normal3(), noise.rotation * kDegree * random.normal3();
    return d;
  };
  Pose mounted = forward_camera();
  mounted.rotation = mounted.rotation * rotation_exp(kDegree * noise.mounting);
  Vector6d before = draw();
  const double own = std::sqrt(1 - noise.shared);
  for (int k = 1; 0.1 * k < flown.duration() - 0.01; ++k) {
    const double t1 = 0.1 * (k - 1);
    const double t2 = 0.1 * k;
    const Pose motion = (flown.body(t2) * mounted).inverse() * (flown.body(t1) * mounted);
    // An image's part of the noise goes into both of its motions, with opposite signs.
    const Vector6d after = draw();
    const Vector6d error = own * draw() + std::sqrt(0.5 * noise.shared) * (after - before);
    before = after;
    CameraMotion m;
    m.t1 = Time::from_seconds(t1);
    m.t2 = Time::from_seconds(t2);
    m.T_body_camera = forward_camera();
    const Vector3d d = motion.translation.normalized();
    const Matrix3d across = Matrix3d::Identity() - d * d.transpose();
    m.direction_2_1 = (d + across * error.head<3>()).normalized();
    m.R_2_1 = (rotation_exp(error.tail<3>()) * motion.rotation).toRotationMatrix();
    const Matrix3d seen = Matrix3d::Identity() - m.direction_2_1 * m.direction_2_1.transpose();
    m.information.topLeftCorner<3, 3>() = seen / std::pow(noise.claimed * noise.direction * kDegree, 2);
    m.information.bottomRightCorner<3, 3>() =
        Matrix3d::Identity() / std::pow(noise.claimed * noise.rotation * kDegree, 2);
    motions.push_back(m);
  }
  return motions;
}

NavigatorOptions options(bool camera) {
  NavigatorOptions options;
  options.filter.camera = camera;
  return options;
}

/// What the filter says of a motion, against the truth.
struct Scored {
  double time = 0;
  double rotation = 0, direction = 0;  ///< errors of the camera's motion, degrees
  double yaw = 0;                      ///< error, degrees
  double yaw_sigma = 0;
  double length = 0;  ///< error of the baseline's, %
  double nees = 0, rotation_nees = 0, translation_nees = 0;
};

/// Plays a flight; each motion is asked for before its own images, or behind them.
std::vector<Scored> play(const Flown& flown, const std::vector<CameraMotion>& motions,
                         const NavigatorOptions& options, bool behind,
                         const Vector3d& mounting_deg = {0, 0, 0}, CameraTally* tally = nullptr) {
  Navigator navigator(options);
  std::vector<Scored> scores;
  Pose mounted = forward_camera();
  mounted.rotation = mounted.rotation * rotation_exp(kDegree * mounting_deg);
  std::size_t next = 0;
  replay(flown.log, navigator, {}, [&](Time now) {
    for (; next < motions.size() && motions[next].t2 <= now; ++next) {
      const CameraMotion& m = motions[next];
      if (behind && options.filter.camera) navigator.add(m);
      const auto pose = navigator.relative_pose(m.t1, m.t2, forward_camera());
      const auto state = navigator.absolute_pose(m.t2);
      if (!behind && options.filter.camera) navigator.add(m);
      if (pose.answer != Answer::valid) continue;
      const double t1 = m.t1.seconds();
      const double t2 = m.t2.seconds();
      const Pose truth = (flown.body(t1) * mounted).inverse() * (flown.body(t2) * mounted);
      Vector6d e;
      e << truth.translation - pose.motion.t_reference_other,
          rotation_log(Matrix3d(truth.matrix3() * pose.motion.R_reference_other.transpose()));
      Scored s;
      s.time = t2;
      s.rotation = e.tail<3>().norm() / kDegree;
      s.direction =
          turn_between(truth.translation.normalized(), pose.motion.t_reference_other.normalized()).norm() /
          kDegree;
      const Vector3d turn =
          rotation_log(Quaterniond(state.T_world_body.rotation * flown.body(t2).rotation.conjugate()));
      s.yaw = std::abs(turn.z()) / kDegree;
      s.yaw_sigma = std::sqrt(state.T_world_body.matrix3().row(2) * state.covariance.topLeftCorner<3, 3>() *
                              state.T_world_body.matrix3().row(2).transpose()) /
                    kDegree;
      s.length = 100 * std::abs(pose.motion.t_reference_other.norm() / truth.translation.norm() - 1);
      s.nees = e.dot(pose.motion.covariance.ldlt().solve(e));
      s.translation_nees =
          e.head<3>().dot(pose.motion.covariance.topLeftCorner<3, 3>().ldlt().solve(e.head<3>()));
      s.rotation_nees =
          e.tail<3>().dot(pose.motion.covariance.bottomRightCorner<3, 3>().ldlt().solve(e.tail<3>()));
      scores.push_back(s);
    }
  });
  if (tally != nullptr) *tally = navigator.camera_tally();
  return scores;
}

struct Summary {
  double rotation_95, direction_95, nees, rotation_nees, translation_nees;
};
Summary summary(const std::vector<Scored>& scores) {
  std::vector<double> rotation, direction;
  Summary s{};
  for (const Scored& one : scores) {
    rotation.push_back(one.rotation);
    direction.push_back(one.direction);
    s.nees += one.nees / static_cast<double>(scores.size());
    s.rotation_nees += one.rotation_nees / static_cast<double>(scores.size());
    s.translation_nees += one.translation_nees / static_cast<double>(scores.size());
  }
  s.rotation_95 = evaluation::quantile(rotation, 0.95);
  s.direction_95 = evaluation::quantile(direction, 0.95);
  return s;
}

/// Some flights, each with its own draw of all that errs.
struct Flights {
  CameraNoise noise{};
  double mounting = 0.3;  ///< standard deviation of its error, degrees per axis
  bool compass = false;
  bool behind = true;
  double wrong = 0;  ///< share of the motions whose direction and rotation are another's
};
struct Outcome {
  Summary summary{};
  double first = 0;  ///< s: of the first pose, latest seed
  double yaw = 0;    ///< largest error from 5 s on, degrees
  CameraTally tally;
};
Outcome fly(const Flights& flights, const char* name = "street") {
  Outcome outcome;
  std::vector<Scored> all;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Flown flown(name, seed, flights.compass);
    Random random(seed);
    CameraNoise noise = flights.noise;
    noise.mounting = flights.mounting * random.normal3();
    auto motions = motions_of(flown, noise, 100 + seed);
    for (CameraMotion& motion : motions) {
      if (random.uniform() >= flights.wrong) continue;
      motion.direction_2_1 = rotation_exp(Vector3d(0.5 * random.normal3())) * motion.direction_2_1;
      motion.R_2_1 = rotation_exp(Vector3d(0.02 * random.normal3())) * motion.R_2_1;
      motion.information.topLeftCorner<3, 3>() *= 0.01;
    }
    CameraTally tally;
    const auto scores = play(flown, motions, options(true), flights.behind, noise.mounting, &tally);
    EXPECT_FALSE(scores.empty()) << seed;
    if (scores.empty()) continue;
    outcome.first = std::max(outcome.first, scores.front().time);
    for (const Scored& s : scores) {
      if (s.time > 5) outcome.yaw = std::max(outcome.yaw, s.yaw);
    }
    outcome.tally.used += tally.used;
    outcome.tally.rotation_only += tally.rotation_only;
    outcome.tally.refused += tally.refused;
    all.insert(all.end(), scores.begin(), scores.end());
  }
  outcome.summary = summary(all);
  std::printf(
      "%s: first pose after %.1f s, yaw from 5 s on within %.2f deg; 95 %% rotation %.4f, direction %.2f "
      "deg; NEES "
      "%.2f (6), rotation %.2f, translation %.2f (3); used %d, rotation only %d, refused %d\n",
      name, outcome.first, outcome.yaw, outcome.summary.rotation_95, outcome.summary.direction_95,
      outcome.summary.nees, outcome.summary.rotation_nees, outcome.summary.translation_nees,
      static_cast<int>(outcome.tally.used), static_cast<int>(outcome.tally.rotation_only),
      static_cast<int>(outcome.tally.refused));
  return outcome;
}

void expect_good(const Outcome& outcome) {
  EXPECT_LT(outcome.first, 5);
  EXPECT_LT(outcome.yaw, 2);
  EXPECT_LT(outcome.summary.rotation_95, 0.025);
  EXPECT_LT(outcome.summary.direction_95, 1);
  EXPECT_GT(outcome.summary.nees, 3.6);
  EXPECT_LT(outcome.summary.nees, 10);
  EXPECT_GT(outcome.summary.rotation_nees, 1.8);
  EXPECT_LT(outcome.summary.rotation_nees, 5);
  EXPECT_GT(outcome.summary.translation_nees, 1.5);
  EXPECT_LT(outcome.summary.translation_nees, 5);
}

TEST(CameraInTheFilter, WithoutACompassAStraightFlightKnowsItsYawAndItsMotionHonestly) {
  expect_good(fly({}));
  expect_good(fly({.behind = false}));
  expect_good(fly({}, "building"));
}

TEST(CameraInTheFilter, NoiseThatNeighboursShareDoesNotMakeItOverconfident) {
  const Outcome outcome = fly({.noise = {.shared = 0.9}});
  EXPECT_LT(outcome.summary.nees, 6.5);
  EXPECT_LT(outcome.summary.rotation_nees, 3.3);
  EXPECT_LT(outcome.summary.translation_nees, 3.3);
  EXPECT_LT(outcome.summary.rotation_95, 0.015);
}

TEST(CameraInTheFilter, DoesNotMakeTheLengthOfTheBaselineWorse) {
  double middle[2];
  for (const bool camera : {false, true}) {
    std::vector<double> lengths;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const Flown flown("street", seed, true);
      for (const Scored& s : play(flown, motions_of(flown, {}, 100 + seed), options(camera), false))
        lengths.push_back(s.length);
    }
    middle[camera ? 1 : 0] = evaluation::quantile(lengths, 0.5);
  }
  std::printf(
      "street, 12 seeds, with a compass: median error of the length %.2f %%, with the camera %.2f %%\n",
      middle[0], middle[1]);
  EXPECT_LT(middle[1], 1.05 * middle[0]);
}

TEST(CameraInTheFilter, ATenthOfTheMotionsMayBeWrong) {
  const Outcome outcome = fly({.wrong = 0.1});
  expect_good(outcome);
  const auto all = static_cast<double>(outcome.tally.used + outcome.tally.refused);
  EXPECT_NEAR(static_cast<double>(outcome.tally.refused) / all, 0.1, 0.04);
}

TEST(CameraInTheFilter, WithoutItAStraightFlightWithoutACompassHasNoPose) {
  const Flown flown("street", 1, false);
  EXPECT_TRUE(play(flown, motions_of(flown, {}, 1), options(false), true).empty());
}

/// What the filter says at the end, when every motion came `delay` after its second image.
RelativePose last_answer(const Flown& flown, const std::vector<CameraMotion>& motions, double delay,
                         bool backwards = false) {
  Navigator navigator(options(true));
  std::size_t next = 0;
  RelativePose answer;
  constexpr double kAsked = 8;
  replay(flown.log, navigator, {}, [&](Time now) {
    const auto come = [&](std::size_t k) {
      return k < motions.size() && Time::from_seconds(motions[k].t2.seconds() + delay) <= now;
    };
    if (backwards) {
      for (; come(next + 1); next += 2) {  // each second one overtakes the one before it
        navigator.add(motions[next + 1]);
        navigator.add(motions[next]);
      }
    } else {
      for (; come(next); ++next) navigator.add(motions[next]);
    }
    if (now == Time::from_seconds(kAsked + 0.6))
      answer = navigator.relative_pose(Time::from_seconds(kAsked - 0.1), Time::from_seconds(kAsked),
                                       forward_camera());
  });
  return answer;
}

TEST(CameraInTheFilter, LateAndOvertakingMotionsEndInTheSameBitsAsPunctualOnes) {
  const Flown flown("street", 3, true, 9);
  const auto motions = motions_of(flown, {}, 3);
  const RelativePose punctual = last_answer(flown, motions, 0);
  ASSERT_EQ(punctual.answer, Answer::valid);
  for (const bool backwards : {false, true}) {
    const RelativePose late = last_answer(flown, motions, 0.13, backwards);
    EXPECT_EQ(late.motion.t_reference_other, punctual.motion.t_reference_other);
    EXPECT_EQ(late.motion.R_reference_other, punctual.motion.R_reference_other);
    EXPECT_EQ(late.motion.covariance, punctual.motion.covariance);
  }
}

TEST(CameraInTheFilter, WhatIsNotExpectedOrMakesNoSenseIsCountedAndChangesNothing) {
  const Flown flown("street", 3, true, 6);
  auto motions = motions_of(flown, {}, 3);
  const auto health_of = [&](const NavigatorOptions& options, const std::vector<CameraMotion>& given,
                             RelativePose& answer) {
    Navigator navigator(options);
    std::size_t next = 0;
    replay(flown.log, navigator, {}, [&](Time now) {
      for (; next < given.size() && given[next].t2 <= now; ++next) navigator.add(given[next]);
    });
    answer = navigator.relative_pose(Time::from_seconds(5), Time::from_seconds(5.1), forward_camera());
    return navigator.health();
  };
  RelativePose without, with;
  EXPECT_EQ(health_of(options(false), {}, without).unusable, 0U);
  EXPECT_EQ(health_of(options(false), motions, with).unusable, motions.size());
  EXPECT_EQ(with.motion.t_reference_other, without.motion.t_reference_other);
  EXPECT_EQ(with.motion.covariance, without.motion.covariance);

  std::vector<CameraMotion> broken(6, motions[30]);
  broken[0].t1 = broken[0].t2;
  broken[1].R_2_1 *= 1.1;
  broken[2].direction_2_1 *= 2;
  broken[3].information(0, 0) = NAN;
  broken[4].information = -broken[4].information;
  broken[5].information(0, 5) += 1e6;
  EXPECT_EQ(health_of(options(true), {}, without).unusable, 0U);
  EXPECT_EQ(health_of(options(true), broken, with).unusable, broken.size());
  EXPECT_EQ(with.motion.t_reference_other, without.motion.t_reference_other);
  motions.resize(20);
  motions.push_back(motions.back());
  EXPECT_EQ(health_of(options(true), motions, with).duplicates, 1U);
}

TEST(CameraInTheFilter, AtRestOnlyTheRotationCounts) {
  // The same place and attitude all the time; whatever direction the images claim is not believed.
  NavigationLog log;
  simulation::SensorOptions sensor_options;
  simulation::SensorSuite sensors(sensor_options, 5);
  for (int i = 0; i < 200 * 8; ++i) {
    simulation::KinematicState still;
    still.time = Time::from_seconds(i / 200.0);
    log.imu.push_back(sensors.imu.sample(still));
    if (i % 40 == 0) {
      const auto epoch = sensors.gnss.sample(still);
      log.gnss.fixes.push_back(epoch.fix);
      log.gnss.velocities.push_back(epoch.velocity);
    }
    if (i % 10 == 0) log.magnetometer.push_back(sensors.magnetometer.sample(still));
  }
  Navigator navigator(options(true));
  int next = 1;
  replay(log, navigator, {}, [&](Time now) {
    for (; Time::from_seconds(0.1 * next) <= now; ++next) {
      CameraMotion m;
      m.t1 = Time::from_seconds(0.1 * (next - 1));
      m.t2 = Time::from_seconds(0.1 * next);
      m.direction_2_1 = Vector3d::UnitX();
      m.information.diagonal() << 0, 1e4, 1e4, 1e7, 1e7, 1e7;
      navigator.add(m);
    }
  });
  const CameraTally tally = navigator.camera_tally();
  EXPECT_LT(tally.used, 6U) << "a baseline of noise alone is seldom long";
  EXPECT_GT(tally.rotation_only, 30U);
  EXPECT_EQ(tally.refused, 0U);
  EXPECT_LT(navigator.absolute_pose(Time::from_seconds(7.5)).velocity.norm(), 0.1);
}

}  // namespace
}  // namespace pade::navigation
