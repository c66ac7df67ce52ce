// A compass that is wrong: what GNSS velocities and inertial sensors say of the yaw, and what the filter
// makes of it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/navigation/integrity/yaw_witness.hpp"
#include "pade/navigation/navigator.hpp"

#include "navigation/flight.hpp"

namespace pade::navigation {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStep = 0.005;  // s

Time at(double seconds) { return Time::from_seconds(seconds); }

/// A vehicle that speeds up and brakes, now in one direction, now in another; the estimate's yaw is off.
class WitnessOf {
 public:
  WitnessOf(double error, double sigma, std::uint64_t seed) : error_(error), sigma_(sigma), random_(seed) {}

  /// @param until  s
  YawWitness& fly(double until) {
    const Eigen::AngleAxisd estimate_from_truth(-error_, Vector3d::UnitZ());
    for (; time_ < until; time_ += kStep) {
      const double direction = 0.5 * std::floor(time_ / 4);
      const double force = std::fmod(time_, 4) < 1.5 ? 1 : std::fmod(time_, 4) < 3 ? -1 : 0;
      const Vector3d change = kStep * force * Vector3d(std::cos(direction), std::sin(direction), 0);
      velocity_ += change;
      witness_.inertial(estimate_from_truth * change);
      if (++steps_ % 40 == 0) {
        const Vector3d noise(random_.normal(), random_.normal(), random_.normal());
        witness_.velocity(velocity_ + sigma_ * noise, sigma_, at(time_ + kStep));
      }
    }
    return witness_;
  }

 private:
  double error_, sigma_;
  Random random_;
  double time_ = 0;
  int steps_ = 0;
  Vector3d velocity_ = Vector3d::Zero();
  YawWitness witness_;
};

TEST(YawWitness, TellsTheErrorOfTheYaw) {
  for (const double error : {-170.0, -90.0, -30.0, 0.0, 10.0, 60.0, 179.0}) {
    WitnessOf flight(error * kDegree, 1e-6, 1);
    const YawWitness& witness = flight.fly(12);
    EXPECT_TRUE(witness.is_clear()) << error;
    EXPECT_NEAR(std::remainder(witness.error() - error * kDegree, 2 * std::numbers::pi), 0, 1e-4) << error;
  }
}

TEST(YawWitness, KnowsHowWellItKnowsIt) {
  constexpr int kFlights = 300;
  double squares = 0, shortest = 1e9;
  int clear = 0;
  for (int i = 0; i < kFlights; ++i) {
    WitnessOf flight(0.5, 0.05, static_cast<std::uint64_t>(i) + 1);
    const YawWitness& witness = flight.fly(10);
    const double z = (witness.error() - 0.5) / witness.sigma();
    squares += z * z;
    clear += witness.is_clear() ? 1 : 0;
    shortest = std::min(shortest, witness.sigma());
  }
  EXPECT_EQ(clear, kFlights);
  EXPECT_GT(shortest, 0.01);
  // Changes that follow each other share a velocity, which makes the mean better than it says, and a force
  // that is not known to 0.03 m/s² has not been given here.
  EXPECT_GT(squares / kFlights, 0.2);
  EXPECT_LT(squares / kFlights, 1.2);
}

TEST(YawWitness, SaysNothingWhereNothingSpeedsUp) {
  YawWitness witness;
  Random random(4);
  for (int i = 0; i < 400; ++i) {
    const Vector3d noise(random.normal(), random.normal(), 0);
    witness.velocity(Vector3d(3, 1, 0) + 0.05 * noise, 0.05, at(0.2 * i));
    for (int k = 0; k < 40; ++k)
      witness.inertial(Vector3d(1e-6 * random.normal(), 1e-6 * random.normal(), 0));
    EXPECT_FALSE(witness.is_clear()) << i;
  }
}

TEST(YawWitness, FollowsTheEstimateThatIsTurned) {
  WitnessOf flight(0.5, 1e-6, 1);
  YawWitness& witness = flight.fly(10.1);
  witness.turned(0.2);
  EXPECT_NEAR(witness.error(), 0.3, 1e-4);
  witness.turned(0.3);
  EXPECT_NEAR(witness.error(), 0, 1e-4);
}

TEST(YawWitness, IsNotMisledByVelocitiesThatJump) {
  WitnessOf flight(0, 0.05, 2);
  YawWitness& witness = flight.fly(10);
  const double before = witness.error();
  witness.velocity(Vector3d(0, 9, 0), 0.05, at(11.2));
  witness.velocity(Vector3d(0, 0, 0), 0.05, at(12.4));
  EXPECT_NEAR(witness.error(), before, 0.02);
  EXPECT_LT(std::abs(before), 4 * witness.sigma());
}

/// How a flight with a compass went.
struct Outcome {
  double until = 0;    ///< s up to which the yaw was wrong by more than 5 degrees
  double worst = 0;    ///< rad, of the yaw, from 30 s on
  double turn = 0;     ///< rad, error of the turn over a tenth of a second, worst
  double fastest = 0;  ///< error of the velocity in the body from take-off on, m/s
  Health health;
};

/// @param turned  by which the field is turned about the vertical from `since` on, rad
Outcome fly(double turned, double since, std::uint64_t seed, const Vector3d& iron = Vector3d::Zero()) {
  simulation::Imu imu(simulation::ImuModel::industrial(), seed);
  simulation::Gnss gnss(simulation::GnssModel::single_point(), seed + 100);
  simulation::Magnetometer magnetometer({}, seed + 200);
  Navigator navigator(NavigatorOptions{});
  Outcome outcome;
  for (int i = 0; i < 200 * 45; ++i) {
    const double t = i / 200.0;
    const auto state = Flight{}.at(t);
    navigator.add(imu.sample(state));
    if (i % 10 == 0) {
      MagneticField field = magnetometer.sample(state);
      if (t >= since) field.field = Eigen::AngleAxisd(turned, Vector3d::UnitZ()) * field.field;
      field.field += field.field.norm() * iron;
      navigator.add(field);
      navigator.add(BarometricHeight{state.time, state.position.z(), 0.3});
    }
    if (i % 40 == 0) {
      const auto epoch = gnss.sample(state);
      navigator.add(epoch.fix);
      navigator.add(epoch.velocity);
    }
    if (i % 20 != 0) continue;
    // Seen as relative motion: over the moment at which the yaw is turned too.
    const RelativePose step = navigator.relative_pose(at(t - 0.1), at(t), Pose{});
    if (step.answer == Answer::valid && t > 3) {
      const Eigen::Quaterniond truly = Flight{}.at(t - 0.1).R_world_body.conjugate() * state.R_world_body;
      const Eigen::Quaterniond believed(step.motion.R_reference_other);
      outcome.turn = std::max(outcome.turn, believed.angularDistance(truly));
    }
    const AbsolutePose known = navigator.absolute_pose(state.time);
    if (known.answer != Answer::valid) continue;
    const Vector3d east = state.R_world_body.conjugate() * known.T_world_body.rotation * Vector3d::UnitX();
    const double yaw = std::abs(std::atan2(east.y(), east.x()));
    if (yaw > 5 * kDegree) outcome.until = t;
    if (t > 30) outcome.worst = std::max(outcome.worst, yaw);
    const Vector3d error = known.T_world_body.rotation.conjugate() * known.velocity -
                           state.R_world_body.conjugate() * state.velocity;
    if (t > 5) outcome.fastest = std::max(outcome.fastest, error.norm());
  }
  outcome.health = navigator.health();
  return outcome;
}

TEST(Compass, ThatIsRightIsNeverDoubted) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Outcome outcome = fly(0, 0, seed);
    EXPECT_EQ(outcome.health.magnetometer_doubted, 0U) << seed;
    EXPECT_EQ(outcome.health.times_lost, 0U) << seed;
    EXPECT_LT(outcome.worst, 3 * kDegree) << seed;
  }
}

/// A field that is turned in the world: no iron of the vehicle explains it.
class WrongCompass : public testing::TestWithParam<double> {};

TEST_P(WrongCompass, IsLeftOut) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Outcome outcome = fly(GetParam() * kDegree, 0, seed);
    EXPECT_GE(outcome.health.magnetometer_doubted, 1U) << seed;
    EXPECT_LT(outcome.until, 28) << seed;
    EXPECT_LT(outcome.turn, 1 * kDegree) << seed << ": what turns the yaw is no motion";
    EXPECT_LT(outcome.worst, 5 * kDegree) << seed;
    EXPECT_LT(outcome.fastest, 0.65) << seed;
    EXPECT_EQ(outcome.health.restarts, 0U) << seed;
  }
}
INSTANTIATE_TEST_SUITE_P(Degrees, WrongCompass, testing::Values(-60.0, -30.0, 30.0, 60.0, 150.0));

TEST(Compass, ThatGoesWrongInFlightIsLeftOut) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Outcome outcome = fly(40 * kDegree, 20, seed);
    EXPECT_GE(outcome.health.magnetometer_doubted, 1U) << seed;
    EXPECT_LT(outcome.until, 10) << seed << ": the yaw does not follow the compass";
    EXPECT_LT(outcome.fastest, 0.3) << seed;
  }
}

TEST(Compass, OfAVehicleWithSomeIronStaysOfUse) {
  const Outcome outcome = fly(0, 0, 3, Vector3d(0, 0.05, 0));
  EXPECT_LT(outcome.worst, 4 * kDegree);
  EXPECT_LT(outcome.fastest, 0.3);
}

}  // namespace
}  // namespace pade::navigation
