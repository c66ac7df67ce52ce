#include "pade/simulation/flight/trajectory.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/simulation/flight/sensors/imu.hpp"

namespace pade::simulation {
namespace {

std::vector<Waypoint> slalom() {
  return {{{0, 0, 2}, 0.1, {}},
          {{6, 2, 2.5}, 0.4, {}},
          {{12, -2, 3}, -0.3, {}},
          {{18, 1, 2}, 0, {}},
          {{25, 0, 2}, 3, {}}};
}

Trajectory flown(const std::vector<Waypoint>& waypoints, const TrajectoryOptions& options = {}) {
  auto path = Trajectory::through(waypoints, options);
  EXPECT_TRUE(path.ok()) << (path.ok() ? "" : path.error().message);
  return std::move(path).value();
}

TEST(Trajectory, PassesThroughItsWaypoints) {
  const auto waypoints = slalom();
  const Trajectory path = flown(waypoints);
  ASSERT_EQ(path.waypoint_times().size(), waypoints.size());
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const KinematicState state = path.at(path.waypoint_times()[i]);
    EXPECT_LT((state.position - waypoints[i].position).norm(), 1e-9);
  }
}

TEST(Trajectory, IsSmoothToTheSixthDerivativeAtWaypoints) {
  for (const PathEnd end : {PathEnd::moving, PathEnd::rest}) {
    TrajectoryOptions options;
    options.start = options.end = end;
    const Trajectory path = flown(slalom(), options);
    for (std::size_t i = 1; i + 1 < path.waypoint_times().size(); ++i) {
      const double t = path.waypoint_times()[i];
      for (int order = 0; order <= 6; ++order) {
        const Eigen::Vector4d before = path.derivative(std::nextafter(t, 0.0), order);
        const Eigen::Vector4d after = path.derivative(t, order);
        EXPECT_LT((after - before).norm(), 1e-7 * (1 + after.norm())) << "order " << order;
      }
    }
  }
}

TEST(Trajectory, StraightLineIsFlownAtConstantSpeed) {
  for (const int points : {2, 3, 4, 6}) {
    std::vector<Waypoint> line;
    for (int i = 0; i < points; ++i) line.push_back({{3.0 * i, 1.0 * i, 2}, 0.5, {}});
    TrajectoryOptions options;
    options.speed = 2;
    const Trajectory path = flown(line, options);
    for (double t = 0; t <= path.duration(); t += 0.1) {
      const KinematicState state = path.at(t);
      EXPECT_NEAR(state.velocity.norm(), 2, 1e-9);
      EXPECT_LT(state.acceleration.norm(), 1e-8);
      EXPECT_LT(state.angular_velocity.norm(), 1e-8);
    }
  }
}

TEST(Trajectory, VelocityAccelerationAndAngularRateAreTheDerivativesOfThePose) {
  TrajectoryOptions options;
  options.drag = 0.2;
  options.roll = {0.1, 3, 0.2};
  options.pitch = {0.05, 2, 0};
  options.yaw = {0.2, 5, 1};
  for (const Heading heading : {Heading::waypoint, Heading::path}) {
    options.heading = heading;
    const Trajectory path = flown(slalom(), options);
    constexpr double h = 1e-4;
    for (double t = 0.1; t < path.duration() - 0.1; t += 0.37) {
      const KinematicState before = path.at(t - h);
      const KinematicState now = path.at(t);
      const KinematicState after = path.at(t + h);
      const Eigen::Vector3d velocity = (after.position - before.position) / (2 * h);
      EXPECT_LT((velocity - now.velocity).norm(), 1e-6);
      EXPECT_LT(((after.velocity - before.velocity) / (2 * h) - now.acceleration).norm(), 1e-6);
      const Eigen::Vector3d rate =
          rotation_log(Eigen::Quaterniond(before.R_world_body.conjugate() * after.R_world_body)) / (2 * h);
      EXPECT_LT((rate - now.angular_velocity).norm(), 1e-6) << "at " << t;
    }
  }
}

TEST(Trajectory, ThrustPointsAlongBodyZ) {
  const Trajectory path = flown(slalom());
  for (double t = 0; t < path.duration(); t += 0.21) {
    const KinematicState state = path.at(t);
    const Eigen::Vector3d force =
        state.R_world_body.conjugate() * (state.acceleration + Eigen::Vector3d(0, 0, 9.80665));
    EXPECT_LT(force.head<2>().norm(), 1e-9);
    EXPECT_GT(force.z(), 5);
  }
}

TEST(Trajectory, StartsAndEndsAtRestOnRequest) {
  TrajectoryOptions options;
  options.start = options.end = PathEnd::rest;
  const Trajectory path = flown(slalom(), options);
  for (const double t : {0.0, path.duration()}) {
    EXPECT_LT(path.at(t).velocity.norm(), 1e-9);
    EXPECT_LT(path.at(t).acceleration.norm(), 1e-8);
  }
}

TEST(Trajectory, HeadingFollowsThePath) {
  TrajectoryOptions options;
  options.heading = Heading::path;
  const Trajectory path = flown(slalom(), options);
  for (double t = 0; t < path.duration(); t += 0.3) {
    const KinematicState state = path.at(t);
    const Eigen::Vector3d left = state.R_world_body * Eigen::Vector3d::UnitY();
    const Eigen::Vector3d horizontal(state.velocity.x(), state.velocity.y(), 0);
    EXPECT_NEAR(left.dot(horizontal), 0, 1e-9);
  }
}

/// A gyroscope that shows nothing while the attitude leaps is no gyroscope.
TEST(Trajectory, AHeadingThatLeapsIsRefused) {
  TrajectoryOptions options;
  options.heading = Heading::path;
  options.speed = 0.7;
  const std::vector<Waypoint> there_and_back = {{{0, 0, 2}, 0, {}}, {{0, 4, 2}, 0, {}}, {{0, 0, 2}, 0, {}}};
  for (const PathEnd end : {PathEnd::moving, PathEnd::rest}) {
    options.start = options.end = end;
    const auto path = Trajectory::through(there_and_back, options);
    ASSERT_FALSE(path.ok());
    EXPECT_THAT(path.error().message, testing::HasSubstr("angular rate between waypoints"));
  }
}

TEST(Trajectory, AtRestItLooksWhereItLeavesAndArrives) {
  TrajectoryOptions options;
  options.heading = Heading::path;
  options.start = options.end = PathEnd::rest;
  const Trajectory path = flown({{{0, 0, 2}, 0, {}}, {{0, 6, 2}, 0, {}}, {{-3, 12, 2}, 0, {}}}, options);
  for (const double t : {0.0, path.duration()}) {
    const KinematicState there = path.at(t);
    const KinematicState near = path.at(t > 0 ? t - 0.2 : 0.2);
    EXPECT_LT(there.R_world_body.angularDistance(near.R_world_body), 0.2) << t;
  }
}

TEST(Trajectory, RefusesWhatTheVehicleCannotFly) {
  const auto refused = [](const std::vector<Waypoint>& waypoints, const TrajectoryOptions& options) {
    const auto path = Trajectory::through(waypoints, options);
    return path.ok() ? std::string("accepted") : path.error().message;
  };
  TrajectoryOptions fast;
  fast.limits.speed = 1;
  EXPECT_THAT(refused(slalom(), fast), testing::HasSubstr("speed between waypoints"));
  TrajectoryOptions gentle;
  gentle.limits.acceleration = 0.1;
  EXPECT_THAT(refused(slalom(), gentle), testing::HasSubstr("acceleration between waypoints"));
  EXPECT_THAT(refused({slalom()[0]}, {}), testing::HasSubstr("expected 2"));
  EXPECT_THAT(refused({slalom()[0], slalom()[0]}, {}), testing::HasSubstr("waypoint 2"));
  EXPECT_THAT(refused({{{0, 0, 0}, 0, {}}, {{1, 0, 0}, 0, 1e300}}, {}),
              testing::HasSubstr("at most 21600 s"));
  EXPECT_THAT(refused({{{0, 0, 0}, 0, {}}, {{1e300, 0, 0}, 0, {}}}, {}),
              testing::HasSubstr("at most 21600 s"));
  EXPECT_THAT(refused({{{0, 0, 0}, 0, {}}, {{1, 0, std::nan("")}, 0, {}}}, {}),
              testing::HasSubstr("not finite"));
  EXPECT_THAT(refused({{{0, 0, 0}, 0, {}}, {{1, 0, 0}, 0, -1}}, {}),
              testing::HasSubstr("expected more than"));
}

TEST(Trajectory, RefusesAPathWhoseAttitudeIsNoNumber) {
  TrajectoryOptions options;
  options.drag = std::nan("");
  const auto path = Trajectory::through(slalom(), options);
  ASSERT_FALSE(path.ok());
  EXPECT_THAT(path.error().message, testing::HasSubstr("found nan"));
}

/// Attitude, velocity and position from gyroscopes and accelerometers alone: fourth order in the time step of
/// two samples (Magnus expansion for the attitude, Simpson and Runge-Kutta for the rest).
struct DeadReckoning {
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();

  void step(const ImuSample& first, const ImuSample& middle, const ImuSample& last, double h,
            double gravity) {
    const auto turned = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                           double dt) {
      // Rates a, b, c at the start, the middle and the end of dt.
      const Eigen::Vector3d mean = (a + 4 * b + c) / 6;
      return Eigen::Quaterniond(rotation_exp(dt * mean + dt * dt / 12 * a.cross(c)));
    };
    const Eigen::Vector3d& w0 = first.angular_rate;
    const Eigen::Vector3d& w1 = middle.angular_rate;
    const Eigen::Vector3d& w2 = last.angular_rate;
    const Eigen::Vector3d quarter = (3 * w0 + 6 * w1 - w2) / 8;  // the parabola through the three
    const Eigen::Quaterniond R1 = R * turned(w0, quarter, w1, 0.5 * h);
    const Eigen::Quaterniond R2 = R * turned(w0, w1, w2, h);
    const Eigen::Vector3d down(0, 0, -gravity);
    const Eigen::Vector3d a0 = R * first.specific_force + down;
    const Eigen::Vector3d a1 = R1 * middle.specific_force + down;
    const Eigen::Vector3d a2 = R2 * last.specific_force + down;
    position += h * velocity + h * h / 6 * (a0 + 2 * a1);
    velocity += h / 6 * (a0 + 4 * a1 + a2);
    R = R2.normalized();
  }
};

TEST(Imu, WithoutNoiseDeadReckonsSixtySecondsWithinAMillimetre) {
  std::vector<Waypoint> points;
  for (int i = 0; i <= 16; ++i)
    points.push_back({{8.0 * i, 3.0 * std::sin(i), 2 + std::cos(2.0 * i)}, 0.3 * i, {}});
  TrajectoryOptions options;
  options.roll = {0.15, 4, 0};
  options.yaw = {0.2, 6, 1};
  const Trajectory path = flown(points, options);
  ASSERT_GE(path.duration(), 60);
  constexpr double kPeriod = 0.005;
  const ImuModel model = ImuModel::perfect();
  Imu imu(model, 1);
  const KinematicState start = path.at(0);
  DeadReckoning body{start.R_world_body, start.velocity, start.position};
  ImuSample first = imu.sample(start);
  for (int i = 2; i <= 12000; i += 2) {
    const ImuSample middle = imu.sample(path.at((i - 1) * kPeriod));
    const ImuSample last = imu.sample(path.at(i * kPeriod));
    body.step(first, middle, last, 2 * kPeriod, model.gravity);
    first = last;
  }
  const KinematicState end = path.at(60);
  EXPECT_LT((body.position - end.position).norm(), 1e-3);
  EXPECT_LT(body.R.angularDistance(end.R_world_body), 1e-6);
  EXPECT_GT((end.position - start.position).norm(), 50);
}

}  // namespace
}  // namespace pade::simulation
