#include "pade/simulation/flight/vehicle.hpp"

#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "pade/simulation/flight/sensor_files.hpp"
#include "pade/simulation/flight/sensor_suite.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
constexpr double kStep = 0.005;
const Vector3d kCalm = Vector3d::Zero();

void fly(Vehicle& vehicle, const Setpoint& setpoint, double seconds, const Vector3d& wind = kCalm) {
  for (int i = 0; i < static_cast<int>(seconds / kStep); ++i)
    vehicle.fly(setpoint, vehicle.state(), wind, kStep);
}

TEST(Vehicle, HoversWhereItIs) {
  Vehicle vehicle({}, {1, 2, 3}, 0.7);
  Setpoint here;
  here.position = {1, 2, 3};
  here.yaw = 0.7;
  fly(vehicle, here, 5);
  EXPECT_LT((vehicle.state().position - Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_LT(vehicle.state().velocity.norm(), 1e-9);
  EXPECT_EQ(vehicle.state().time.nanoseconds, 5'000'000'000);
}

TEST(Vehicle, ReachesTheSpeedThatItIsToldAndTiltsForIt) {
  const VehicleModel model;
  Vehicle vehicle(model, {0, 0, 2}, 0);
  double greatest_tilt = 0;
  for (int i = 0; i < 800; ++i) {
    Setpoint s;
    s.velocity = {2, 0, 0};
    s.position = vehicle.state().position;
    vehicle.fly(s, vehicle.state(), kCalm, kStep);
    greatest_tilt = std::max(
        greatest_tilt, std::acos(std::min(1.0, (vehicle.state().R_world_body * Vector3d::UnitZ()).z())));
  }
  EXPECT_NEAR(vehicle.state().velocity.x(), 2, 0.02);
  EXPECT_NEAR(vehicle.state().velocity.z(), 0, 0.02);
  EXPECT_GT(greatest_tilt, 0.2);
  EXPECT_LT(greatest_tilt, model.tilt + 0.05);
  // Against the drag it leans forward: thrust times the sine of the tilt is drag times speed.
  const Vector3d up = vehicle.state().R_world_body * Vector3d::UnitZ();
  EXPECT_NEAR(std::atan2(up.x(), up.z()), std::atan(model.drag * 2 / model.gravity), 0.01);
}

TEST(Vehicle, AGustPushesItAndItComesBack) {
  Vehicle vehicle({}, {0, 0, 2}, 0);
  Setpoint here;
  here.position = {0, 0, 2};
  double farthest = 0;
  for (int i = 0; i < 10; ++i) {
    fly(vehicle, here, 0.2, {0, 5, 0});
    farthest = std::max(farthest, vehicle.state().position.y());
  }
  EXPECT_GT(farthest, 0.05);
  EXPECT_LT(farthest, 0.3);
  // Wind that lasts does not keep it beside its place.
  fly(vehicle, here, 5, {0, 5, 0});
  EXPECT_LT((vehicle.state().position - here.position).norm(), 0.02);
  fly(vehicle, here, 8);
  EXPECT_LT((vehicle.state().position - here.position).norm(), 0.01);
}

/// What the accelerometer of a stepped vehicle shows, integrated, is where it flies.
TEST(Vehicle, ItsStateFitsItsAccelerations) {
  Vehicle vehicle({}, {0, 0, 2}, 0);
  Vector3d velocity = Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();
  for (int i = 0; i < 1000; ++i) {
    Setpoint s;
    s.velocity = {std::sin(0.01 * i), std::cos(0.013 * i), 0.2};
    s.position = vehicle.state().position;
    s.yaw = 0.002 * i;
    const KinematicState before = vehicle.state();
    vehicle.fly(s, before, {0.5, 0, 0}, kStep);
    velocity += 0.5 * kStep * (before.acceleration + vehicle.state().acceleration);
    attitude =
        attitude * rotation_exp(0.5 * kStep * (before.angular_velocity + vehicle.state().angular_velocity));
    EXPECT_LT((vehicle.state().angular_velocity - before.angular_velocity).norm(), 1.1);  // no jumps
  }
  EXPECT_LT((velocity - vehicle.state().velocity).norm(), 1e-9);
  EXPECT_LT(attitude.angularDistance(vehicle.state().R_world_body), 1e-9);
  EXPECT_NEAR(2 * std::atan2(attitude.z(), attitude.w()), 0.002 * 999, 0.15);
}

/// The instruments of a vehicle give, moment by moment, what the files of a path have.
TEST(SensorSuite, StreamsWhatTheFilesHave) {
  const auto path = Trajectory::through({{{0, 0, 2}, 0, {}}, {{3, 1, 2.2}, 0.3, {}}});
  ASSERT_TRUE(path.ok());
  const SensorOptions options;
  const auto files = sensor_files(*path, options, 9);
  SensorSuite suite(options, 9);
  SampleClock imu(options.imu_rate);
  SampleClock baro(options.baro_rate);
  SampleClock gnss(options.gnss_rate);
  std::istringstream inertial(files.at("imu.csv"));
  std::istringstream heights(files.at("baro.csv"));
  std::istringstream fixes(files.at("gnss.csv"));
  std::string line;
  for (std::istringstream* file : {&inertial, &heights, &fixes}) {
    std::getline(*file, line);
    std::getline(*file, line);
  }
  const auto next = [&](std::istringstream& file) {
    std::getline(file, line);
    return line.substr(0, line.find(','));
  };
  const auto third = [&] { return std::stod(line.substr(line.find(',') + 1)); };
  int samples = 0;
  for (int i = 0; i / options.imu_rate <= path->duration() + 1e-9; ++i) {
    const KinematicState truth = path->at(i / options.imu_rate);
    if (imu.is_due(truth.time.seconds())) {
      ++samples;
      EXPECT_EQ(next(inertial), to_string(truth.time));
      EXPECT_NEAR(third(), suite.imu.sample(truth).angular_rate.x(), 1e-8);
    }
    if (baro.is_due(truth.time.seconds())) {
      EXPECT_EQ(next(heights), to_string(truth.time));
      EXPECT_NEAR(third(), suite.barometer.sample(truth).height, 1e-3);
    }
    if (gnss.is_due(truth.time.seconds())) {
      EXPECT_EQ(next(fixes), to_string(truth.time));
      EXPECT_NEAR(third(), suite.gnss.sample(truth).fix.position.x(), 1e-6);
    }
  }
  EXPECT_GT(samples, 200);
}

}  // namespace
}  // namespace pade::simulation
