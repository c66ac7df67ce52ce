// What each sensor does to the filter, one property at a time: signs, axes, noise, resets.
#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "pade/navigation/filter.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/replay.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

Time at(double seconds) { return Time::from_seconds(seconds); }

BaseMatrix covariance(double attitude, double velocity, double position) {
  BaseMatrix P = BaseMatrix::Zero();
  const auto set = [&](int first, double sigma) {
    P.diagonal().segment<3>(first).setConstant(sigma * sigma);
  };
  set(kPhi, attitude);
  set(kNu, velocity);
  set(kRho, position);
  set(kGyroscopeBias, 1e-3);
  set(kAccelerometerBias, 1e-2);
  return P;
}

Filter started(const BaseMatrix& P, const NavigationState& state = {}) {
  Filter filter(FilterOptions{}, Vector3d::Zero());
  filter.start(state, P);
  return filter;
}

void hover(Filter& filter, double until) {
  for (double t = filter.state().time.seconds(); t < until - 1e-9; t += 0.01) {
    filter.propagate(at(t + 0.01), Vector3d::Zero(), {0, 0, filter.options().gravity}, Vector3d::Zero());
  }
}

TEST(SensorModels, AnInflatedResidualMovesTheStateAsIfItLayOnTheGate) {
  Filter filter = started(covariance(1e-6, 0.5, 1));
  const double residual = 0.5 * 4.5;
  const Innovation innovation =
      filter.update(GnssVelocity{Time{}, {residual, 0, 0}, 1e-4 * Matrix3d::Identity()});
  ASSERT_EQ(innovation.verdict, Verdict::inflated);
  const double excess = innovation.chi_square / filter.options().gate_probability_3;
  EXPECT_NEAR(filter.state().X.v.x(), residual / excess, 1e-3 * residual);
  EXPECT_NEAR(filter.covariance()(kNu, kNu), 0.25 * (1 - 1 / excess), 2e-3);
}

TEST(SensorModels, AReceiverThatFixesItsAmbiguitiesHasAnotherBias) {
  Filter filter = started(covariance(1e-6, 0.01, 0.01));
  filter.update(GnssFix{Time{}, {2, 0, 0}, Matrix3d::Identity()});
  ASSERT_GT(filter.state().position_bias.x(), 1.5);
  const Innovation innovation = filter.update(GnssFix{Time{}, Vector3d::Zero(), 1e-4 * Matrix3d::Identity()});
  EXPECT_EQ(innovation.verdict, Verdict::accepted) << "the bias of single points is none of carrier phase";
  EXPECT_LT(filter.state().position_bias.norm(), 0.05);
  EXPECT_LT(std::sqrt(filter.covariance()(kPositionBias, kPositionBias)), 0.01);
}

TEST(SensorModels, AnAnnouncedErrorIsBelievedAtOnce) {
  Filter filter = started(covariance(1e-6, 0.01, 0.01));
  for (int i = 0; i < 20; ++i) filter.update(GnssFix{Time{}, Vector3d::Zero(), Matrix3d::Identity()});
  const double before = filter.covariance()(kPositionBias, kPositionBias);
  EXPECT_EQ(filter.update(GnssFix{Time{}, {12, 0, 0}, 25 * Matrix3d::Identity()}).verdict, Verdict::accepted);
  EXPECT_GT(filter.covariance()(kPositionBias, kPositionBias), before + 1);
  EXPECT_LT(filter.state().X.p.norm(), 0.1);
}

/// A field of norm 1 that dips by `dip` and points `declination` east of north, in body axes.
Vector3d field_at(const Quaterniond& R, double declination, double dip) {
  const Vector3d world(std::cos(dip) * std::sin(declination), std::cos(dip) * std::cos(declination),
                       -std::sin(dip));
  return R.conjugate() * world;
}

TEST(SensorModels, MagneticNorthLiesTheDeclinationEastOfNorth) {
  for (const double declination : {-0.3, 0.2}) {
    NavigationState state;
    state.X.R = rotation_exp({0.2, -0.1, 1.1});
    Filter filter = started(covariance(0.1, 0.1, 1), state);
    const MagneticField field{Time{}, field_at(state.X.R, declination, 1.1), 0.006};
    EXPECT_NEAR(filter.update(field, declination).residual.x(), 0, 1e-9);
    filter = started(covariance(0.1, 0.1, 1), state);
    EXPECT_NEAR(filter.update(field, 0).residual.x(), declination, 1e-9);
  }
}

TEST(SensorModels, ASteepFieldSaysLessOfTheAzimuth) {
  for (const double dip : {0.0, 0.8, 1.3}) {
    Filter filter = started(covariance(1e-6, 0.1, 1));
    const MagneticField field{Time{}, field_at(filter.state().X.R, 0, dip), 0.02};
    EXPECT_NEAR(filter.update(field, 0).sigma.x(), 0.02 / std::cos(dip), 2e-4 / std::cos(dip)) << dip;
  }
}

TEST(SensorModels, AStartAtRestTakesItsYawFromTheFieldAndTheDeclination) {
  NavigationLog log =
      record(Flight{}, 4, simulation::ImuModel::perfect(), simulation::GnssModel::single_point(), 1);
  const Quaterniond R = log.truth.front().T_world_body.rotation;
  for (double t = 0; t < 4; t += 0.1) log.magnetometer.push_back({at(t), field_at(R, 0.25, 1.1), 0.006});
  NavigatorOptions options;
  options.declination = 0.25;
  Navigator navigator(options);
  AbsolutePose pose;
  replay(log, navigator, {}, [&](Time now) {
    if (now == at(3.5)) pose = navigator.absolute_pose(now);
  });
  ASSERT_EQ(pose.answer, Answer::valid);
  EXPECT_LT(rotation_log(Quaterniond(pose.T_world_body.rotation * R.conjugate())).norm(), 0.01);
}

TEST(SensorModels, AVehicleThatTurnsSwingsItsAxle) {
  double sigma[2];
  for (int k = 0; k < 2; ++k) {
    NavigationState state;
    state.angular_rate = Vector3d(0, 0, k);
    Filter filter = started(covariance(1e-6, 1e-3, 1), state);
    sigma[k] = filter.update(RoadMotion{Time{}, 0.2}).sigma.x();
  }
  EXPECT_NEAR(sigma[0], 0.2, 0.01);
  EXPECT_NEAR(sigma[1], std::hypot(0.2, 1.0), 0.01) << "1 rad/s a metre from the axle";
}

TEST(SensorModels, ASaturatedInstrumentSaysLittle) {
  const FilterOptions options;
  const Vector3d up(0, 0, options.gravity);
  const auto grown = [&](const Vector3d& rate, const Vector3d& force) {
    Filter filter = started(covariance(1e-6, 1e-6, 1e-6));
    filter.propagate(at(0.01), rate, force, rate);
    const BaseMatrix P = filter.covariance();
    return Eigen::Vector2d(std::sqrt(P(kPhi + 2, kPhi + 2)), std::sqrt(P(kNu, kNu)));
  };
  const Eigen::Vector2d calm = grown(Vector3d::Zero(), up);
  EXPECT_GT(grown({0, 0, 1.1 * options.gyroscope_range}, up)[0], 50 * calm[0]);
  EXPECT_GT(grown(Vector3d::Zero(), {1.1 * options.accelerometer_range, 0, 0})[1], 50 * calm[1]);
}

TEST(SensorModels, CovariancesOfDecayingErrorsStaySymmetric) {
  Filter filter = started(covariance(0.1, 1, 5));
  filter.update(BarometricHeight{Time{}, 100, 0.5});
  hover(filter, 1);
  filter.update(BarometricHeight{filter.state().time, 101, 0.5});
  filter.update(GnssFix{filter.state().time, {1, 2, 3}, Matrix3d::Identity()});
  for (int i = 1; i <= 30; ++i) {
    filter.propagate(at(1 + i), Vector3d::Zero(), {0, 0, filter.options().gravity}, Vector3d::Zero());
  }
  const BaseMatrix P = filter.covariance();
  EXPECT_GT(std::abs(P(kRho + 2, kHeightBias)), 1e-3) << "the test is of something";
  for (int i = 0; i < kBase; ++i) {
    EXPECT_LT((P.col(i) - P.row(i).transpose()).norm(), 1e-12 * (1 + P.col(i).norm())) << i;
  }
}

TEST(Navigator, LatencyIsWhatStampsAreLate) {
  NavigationLog log =
      record(Flight{}, 20, simulation::ImuModel::industrial(), simulation::GnssModel::single_point(), 3);
  const Flight flight;
  simulation::Barometer barometer({}, 3);
  simulation::Magnetometer magnetometer({}, 4);
  for (double t = 0; t < 20; t += 0.1) {
    log.barometer.push_back(barometer.sample(flight.at(t)));
    log.magnetometer.push_back(magnetometer.sample(flight.at(t)));
  }
  NavigationLog late = log;
  const auto shift = [](auto& measurements, double seconds) {
    for (auto& m : measurements) m.time.nanoseconds += Time::from_seconds(seconds).nanoseconds;
  };
  shift(late.gnss.fixes, 0.1);
  shift(late.gnss.velocities, 0.15);
  shift(late.barometer, 0.2);
  shift(late.magnetometer, 0.05);
  NavigatorOptions options;
  options.gnss_position_latency = 0.1;
  options.gnss_velocity_latency = 0.15;
  options.barometer_latency = 0.2;
  options.magnetometer_latency = 0.05;
  RelativePose answers[2];
  for (int k = 0; k < 2; ++k) {
    Navigator navigator(k == 0 ? NavigatorOptions{} : options);
    replay(k == 0 ? log : late, navigator, {}, [&](Time now) {
      if (now == at(19)) answers[k] = navigator.relative_pose(at(18.3), at(18.4), Pose{});
    });
    ASSERT_EQ(answers[k].answer, Answer::valid);
  }
  EXPECT_EQ(answers[0].motion.t_reference_other, answers[1].motion.t_reference_other);
  EXPECT_EQ(answers[0].motion.covariance, answers[1].motion.covariance);
}

TEST(Navigator, TheCovarianceOfAMotionIsInTheAxesOfItsFirstFrame) {
  // Straight on, turning fast about the vertical: what is not known is the yaw, so the doubt of the motion
  // lies across it, in the axes of the first frame.
  NavigationLog log;
  simulation::Imu imu(simulation::ImuModel::industrial(), 7);
  simulation::Gnss gnss({}, 8);
  for (int i = 0; i <= 200 * 6; ++i) {
    simulation::KinematicState state;
    state.time = at(i / 200.0);
    state.velocity = {2, 0, 0};
    state.position = {2 * i / 200.0, 0, 0};
    state.R_world_body = rotation_exp({0, 0, 2.5 * i / 200.0});
    state.angular_velocity = {0, 0, 2.5};
    log.imu.push_back(imu.sample(state));
    log.truth.push_back({state.time, {state.R_world_body, state.position}, state.velocity});
    if (i % 40 != 0) continue;
    const auto epoch = gnss.sample(state);
    log.gnss.fixes.push_back(epoch.fix);
    log.gnss.velocities.push_back(epoch.velocity);
  }
  // The magnetometer of a vehicle with much iron: a yaw with some degrees of doubt.
  for (const TrueState& truth : log.truth) {
    log.magnetometer.push_back({truth.time, field_at(truth.T_world_body.rotation, 0, 1.1), 0.3});
  }
  const Pose T_body_camera{Quaterniond(forward_camera_rotation()), Vector3d::Zero()};
  Navigator navigator(NavigatorOptions{});
  RelativePose body;
  RelativePose camera;
  replay(log, navigator, {}, [&](Time now) {
    if (now != at(6)) return;
    body = navigator.relative_pose(at(5.6), now, Pose{});
    camera = navigator.relative_pose(at(5.6), now, T_body_camera);
  });
  ASSERT_EQ(body.answer, Answer::valid);
  const Matrix3d P = body.motion.covariance.topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(P);
  const Vector3d doubt = solver.eigenvectors().col(2);
  const Vector3d along = body.motion.t_reference_other.normalized();
  EXPECT_GT(solver.eigenvalues()[2], 4 * solver.eigenvalues()[1]) << "the yaw dominates";
  EXPECT_LT(std::abs(doubt.dot(along)), 0.2) << "the frames are turned by 1 rad";
  // The axes of the camera are the body's turned by its mounting.
  const Matrix3d C = T_body_camera.matrix3();
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = C.transpose();
  const Matrix6d expected = turn * body.motion.covariance * turn.transpose();
  EXPECT_LT((camera.motion.covariance - expected).norm(), 1e-9 * expected.norm());
}

}  // namespace
}  // namespace pade::navigation
