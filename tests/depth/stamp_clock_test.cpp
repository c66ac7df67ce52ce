// Offsets between the stamps of images and those of poses, on turns of known rate.
#include "pade/depth/motion/stamp_clock.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace {

using namespace pade;
using Eigen::Vector3d;

/// A camera that swings about all axes, unevenly.
Pose pose_at(double t) {
  const auto turn = [](double angle, const Vector3d& axis) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
  };
  return {turn(0.3 * std::sin(0.9 * t) + 0.1 * std::sin(2.7 * t), Vector3d::UnitY()) *
              turn(0.08 * std::sin(2.1 * t + 1), Vector3d::UnitX()) *
              turn(0.1 * std::sin(1.5 * t + 2), Vector3d::UnitZ()),
          {t, 0, 0}};
}

/// Flies with stamps that want `offset` added to them.
struct Flight {
  double offset = 0;
  double period = 0.1;
  double noise = 0;     // rad, of what the images say
  double nonsense = 0;  // share of pairs that say anything
  double seconds = 20;
  unsigned seed = 1;
  bool even = false;       // turns at constant rate
  bool gyroscope = false;  // tells the rates

  [[nodiscard]] depth::StampClock flown(int* told = nullptr) const {
    depth::StampClock clock;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto at = [&](double t) {
      return even ? Pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * t, Vector3d::UnitY())), {t, 0, 0}}
                  : pose_at(t);
    };
    Pose last_given;
    Pose last_true;
    for (int i = 0; i * period < seconds; ++i) {
      const Pose given = at(i * period);
      const Pose truth = at(i * period + offset);
      std::optional<Vector3d> rate;
      if (gyroscope) {
        constexpr double kStep = 1e-3;
        rate = rotation_log(at(i * period - kStep).rotation.conjugate() * at(i * period + kStep).rotation) /
               (2 * kStep);
      }
      Vector3d turn = Vector3d::Zero();
      const bool telling = i > 0 && clock.is_telling(Time::from_seconds(i * period), given, rate);
      if (told != nullptr) *told += telling ? 1 : 0;
      if (telling) {
        const Eigen::Quaterniond R_given = given.rotation.conjugate() * last_given.rotation;
        const Eigen::Quaterniond R_true = truth.rotation.conjugate() * last_true.rotation;
        turn = rotation_log(R_true * R_given.conjugate()) +
               noise * Vector3d(normal(random), normal(random), normal(random));
        if (0.5 * (1 + uniform(random)) < nonsense)
          turn = 0.05 * Vector3d(uniform(random), uniform(random), uniform(random));
      }
      clock.add(
          Time::from_seconds(i * period), given, rate, turn,
          telling ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : Eigen::Matrix3d(Eigen::Matrix3d::Zero()));
      last_given = given;
      last_true = truth;
    }
    return clock;
  }
};

TEST(StampClock, FindsOffsetsOfEitherSign) {
  for (const double offset : {-0.05, -0.03, -0.008, 0.008, 0.03, 0.05}) {
    for (const auto& [period, gyroscope] :
         {std::pair{0.05, false}, {0.1, false}, {0.1, true}, {0.15, true}}) {
      Flight flight;
      flight.gyroscope = gyroscope;
      flight.offset = offset;
      flight.period = period;
      flight.noise = 2e-4;
      const auto found = flight.flown().found();
      ASSERT_TRUE(found) << offset << " s, period " << period << " s";
      EXPECT_TRUE(found->is_certain()) << offset;
      EXPECT_NEAR(found->seconds, offset, 0.1 * std::abs(offset) + 4 * found->sigma) << period;
      EXPECT_LT(found->sigma, 1e-3);
    }
  }
}

TEST(StampClock, SigmaIsThatOfItsErrors) {
  double squares = 0;
  constexpr int kFlights = 40;
  for (unsigned seed = 1; seed <= kFlights; ++seed) {
    Flight flight;
    flight.noise = 5e-4;
    flight.seed = seed;
    const auto found = flight.flown().found();
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->is_certain()) << seed;
    squares += std::pow(found->seconds / found->sigma, 2);
  }
  // Pairs are independent here, and count as correlated: the sigma is at most sqrt(2) too large.
  EXPECT_GT(squares / kFlights, 0.25);
  EXPECT_LT(squares / kFlights, 1.3);
}

TEST(StampClock, AFifthOfNonsenseDoesNotCount) {
  Flight flight;
  flight.offset = -0.03;
  flight.noise = 2e-4;
  flight.nonsense = 0.2;
  const auto found = flight.flown().found();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->seconds, -0.03, 0.004);
}

TEST(StampClock, EvenTurnsTellNothing) {
  Flight flight;
  flight.offset = 0.03;
  flight.even = true;
  int told = 0;
  EXPECT_FALSE(flight.flown(&told).found());
  EXPECT_EQ(told, 0);
}

TEST(StampClock, ForgetsWhenTold) {
  Flight flight;
  flight.offset = 0.03;
  depth::StampClock clock = flight.flown();
  ASSERT_TRUE(clock.found());
  clock.clear();
  EXPECT_FALSE(clock.found());
}

TEST(StampClock, AGapIsNoPair) {
  // Rates across a gap would be wrong: what was found before stays, nothing is added.
  Flight flight;
  flight.offset = 0.03;
  depth::StampClock clock = flight.flown();
  const auto before = clock.found();
  clock.add(Time::from_seconds(100), pose_at(3), {}, Vector3d(0.09, 0, 0), Eigen::Matrix3d::Identity());
  clock.add(Time::from_seconds(100.1), pose_at(4), {}, Vector3d(0.09, 0, 0), Eigen::Matrix3d::Identity());
  clock.add(Time::from_seconds(100.2), pose_at(5), {}, Vector3d(0.09, 0, 0), Eigen::Matrix3d::Identity());
  ASSERT_TRUE(clock.found());
  EXPECT_EQ(clock.found()->pairs, before->pairs);
}

}  // namespace
