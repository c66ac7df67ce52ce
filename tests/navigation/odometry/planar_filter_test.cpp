// The planar filter on made-up drives: a car that is told neither its yaw nor its wheels' scale.
#include "pade/navigation/odometry/planar_filter.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pade::navigation {
namespace {

constexpr double kInterval = 0.2;  // s
constexpr double kScale = 1.013;   // true way over measured way
constexpr double kBias = 0.003;    // of the yaw rate, rad/s
constexpr double kDrift = 40;      // of the clock, m/s

/// Twelve satellites of two systems that stand still, ENU.
std::vector<RawSatellite> heaven() {
  std::vector<RawSatellite> all;
  for (int i = 0; i < 12; ++i) {
    const double azimuth = 2.4 * i, elevation = 0.25 + 0.1 * i;
    RawSatellite s;
    s.satellite = {i % 3 == 0 ? gnss::System::glonass : gnss::System::gps, static_cast<std::uint8_t>(i + 1)};
    s.position = 2.2e7 * Vector3d(std::cos(elevation) * std::sin(azimuth),
                                  std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
    s.range_sigma = 2;
    all.push_back(s);
  }
  return all;
}

/// A car that goes round corners, and what its sensors say.
class Drive {
 public:
  explicit Drive(double yaw, unsigned seed = 1) : yaw_(yaw), random_(seed) {}

  double noise = 2;       ///< of a range, m
  double late_share = 0;  ///< of the ranges that are reflected
  double late_by = 50;    ///< m
  double clock_jump = 0;  ///< m, at 20 s
  bool odometry_noise = true;

  [[nodiscard]] double time() const { return kInterval * steps_; }
  [[nodiscard]] Time stamp() const { return Time::from_seconds(time()); }
  [[nodiscard]] const Vector3d& position() const { return position_; }
  [[nodiscard]] double yaw() const { return yaw_; }

  /// Moves on by an interval and says what the odometry has measured in it.
  PlanarOdometry go() {
    const double speed = 8 + 3 * std::sin(0.2 * time());
    const double yaw_rate = std::fmod(time(), 30) > 24 ? 0.26 : 0.01 * std::cos(0.3 * time());
    const double middle = yaw_ + 0.5 * yaw_rate * kInterval;
    position_ += speed * kInterval * Vector3d(std::cos(middle), std::sin(middle), 0);
    yaw_ += yaw_rate * kInterval;
    PlanarOdometry measured{stamp(), speed / kScale, yaw_rate + kBias, 0.05, 0.002};
    if (odometry_noise) {
      measured.speed += 0.05 * normal_(random_);
      measured.yaw_rate += 0.002 * normal_(random_);
    }
    ++steps_;
    return measured;
  }
  /// What the receiver measures now.
  RawEpoch observe() {
    RawEpoch epoch;
    epoch.time = stamp();
    epoch.satellites = heaven();
    std::uniform_real_distribution<double> share(0, 1);
    for (RawSatellite& s : epoch.satellites) {
      const double system = s.satellite.system == gnss::System::glonass ? -7 : 0;
      const double clock = 5000 + kDrift * time() + (time() >= 20 ? clock_jump : 0);
      s.range = (s.position - position_).norm() + clock + system + noise * normal_(random_);
      if (share(random_) < late_share) *s.range += late_by;
    }
    epoch.fix =
        GnssFix{epoch.time, position_ + 3 * Vector3d(normal_(random_), normal_(random_), normal_(random_)),
                9 * Matrix3d::Identity()};
    return epoch;
  }

 private:
  double yaw_;
  Vector3d position_{20, -10, 5};
  int steps_ = 0;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

/// Noise as the drive has it: white, no reflections, no slip.
PlanarOptions white() {
  PlanarOptions o;
  o.correlation_time = o.doubt = 0;
  o.scale_walk = o.yaw_rate_bias_walk = o.yaw_noise = o.turn_noise = o.path_noise = 0;
  o.height_walk = 0.001, o.clock_noise = 0.01, o.clock_drift_walk = 0.001;
  return o;
}

/// Starts the filter somewhere near and drives on for a time.
void drive(Drive& car, PlanarFilter& filter, double seconds, bool loose = false) {
  if (!filter.started()) filter.start(car.stamp(), car.position() + Vector3d(60, -40, 30));
  const double end = car.time() + seconds - 1e-6;
  while (car.time() < end) {
    const PlanarOdometry measured = car.go();
    filter.propagate(car.stamp(), measured);
    const RawEpoch epoch = car.observe();
    if (loose) {
      filter.update(*epoch.fix);
    } else {
      filter.update(epoch);
    }
  }
}

double off(const Drive& car, const PlanarFilter& filter) {
  return (filter.estimate().position - car.position()).norm();
}

TEST(PlanarFilter, FindsYawScaleAndBiasThatItWasNotTold) {
  for (const bool loose : {false, true}) {
    for (int i = 0; i < 8; ++i) {
      Drive car(0.8 * i, static_cast<unsigned>(i));
      PlanarFilter filter(white());
      drive(car, filter, 90, loose);
      const PlanarEstimate now = filter.estimate();
      EXPECT_TRUE(now.yaw_known);
      EXPECT_LT(std::abs(std::remainder(now.yaw - car.yaw(), 2 * M_PI)), 4 * now.yaw_sigma + 1e-3) << i;
      EXPECT_LT(now.yaw_sigma, 0.03);
      EXPECT_NEAR(now.scale, kScale, 0.01) << i;
      EXPECT_NEAR(now.yaw_rate_bias, kBias, 0.001) << i;
      EXPECT_LT(off(car, filter), 4) << i;
      if (!loose) {
        EXPECT_NEAR(now.drift, kDrift, 1);
      }
    }
  }
}

TEST(PlanarFilter, ErrorsAreAsLargeAsTheCovarianceSays) {
  double position = 0, yaw = 0, bias = 0;
  constexpr int kDrives = 60;
  for (unsigned seed = 0; seed < kDrives; ++seed) {
    Drive car(0.1 * seed, seed + 100);
    PlanarFilter filter(white());
    drive(car, filter, 40);
    const PlanarEstimate now = filter.estimate();
    const Vector3d error = now.position - car.position();
    position += error.dot(now.covariance.ldlt().solve(error)) / kDrives;
    yaw += std::pow(std::remainder(now.yaw - car.yaw(), 2 * M_PI) / now.yaw_sigma, 2) / kDrives;
    bias += std::pow(now.yaw_rate_bias - kBias, 2) / filter.covariance()(kPlanarBias, kPlanarBias) / kDrives;
  }
  // 60 draws: the mean of 3 degrees of freedom within 3 ± 0.95, of one within 1 ± 0.55 (3 sigma).
  EXPECT_NEAR(position, 3, 0.95);
  EXPECT_NEAR(yaw, 1, 0.55);
  EXPECT_NEAR(bias, 1, 0.55);
}

TEST(PlanarFilter, ATurnByAnUnknownAngleIsThatOfManyTurns) {
  Drive car(1);
  PlanarFilter filter(white());
  drive(car, filter, 40);
  const Eigen::Vector2d mean = filter.state().segment<2>(kPlanarHeading);
  const Eigen::Matrix2d root =
      filter.covariance().block<2, 2>(kPlanarHeading, kPlanarHeading).llt().matrixL();
  const PlanarMatrix before = filter.covariance();
  PlanarOdometry standing{car.stamp(), 0, filter.estimate().yaw_rate_bias, 0, 0.7 / kInterval};
  filter.propagate(Time::from_seconds(car.time() + kInterval), standing);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector2d drawn = mean + root * Eigen::Vector2d(normal(random), normal(random));
    const Eigen::Vector2d turned = Eigen::Rotation2Dd(0.7 * normal(random)) * drawn;
    sum += turned / kDraws;
    squares += turned * turned.transpose() / kDraws;
  }
  EXPECT_LT((filter.state().segment<2>(kPlanarHeading) - sum).norm(), 0.01);
  EXPECT_LT(
      (filter.covariance().block<2, 2>(kPlanarHeading, kPlanarHeading) - (squares - sum * sum.transpose()))
          .norm(),
      0.01);
  const PlanarMatrix after = filter.covariance();
  EXPECT_LT((after.topLeftCorner<3, 3>() - before.topLeftCorner<3, 3>()).norm(), 1e-3);
  EXPECT_LT((after - after.transpose()).norm(), 1e-9);
  // What heading and position have in common is turned away with the heading's mean.
  const Eigen::Matrix<double, 3, 2> common = before.block<3, 2>(0, kPlanarHeading);
  const Eigen::Matrix<double, 3, 2> left = after.block<3, 2>(0, kPlanarHeading);
  EXPECT_LT((left - std::exp(-0.5 * 0.49) * common).norm(), 0.02 * common.norm());
}

TEST(PlanarFilter, AGapIsAsLongInOneStepAsInMany) {
  const auto after = [](int steps) {
    Drive car(2);
    PlanarFilter filter(white());
    drive(car, filter, 40);
    const PlanarOdometry held{car.stamp(), 5, 0, 0, 0};
    const double start = car.time();
    for (int i = 1; i <= steps; ++i) filter.propagate(Time::from_seconds(start + 6.0 * i / steps), held);
    EXPECT_EQ(filter.tally().gaps, 1U);
    return filter;
  };
  const PlanarFilter once = after(1), often = after(30);
  const PlanarEstimate a = once.estimate(), b = often.estimate();
  EXPECT_GT(a.covariance(0, 0), 36 * 36 * 0.8);  // half of 2 m/s² by 6 s
  // The shrinking heading shortens the way of many steps, which says that the yaw is lost.
  EXPECT_LT((a.position - b.position).norm(), 20);
  EXPECT_NEAR(a.covariance(0, 0) / b.covariance(0, 0), 1, 0.4);
  EXPECT_NEAR(a.yaw_sigma / b.yaw_sigma, 1, 0.05);
}

TEST(PlanarFilter, AGapBeginsWithoutAJump) {
  const auto variance_after = [](double seconds) {
    Drive car(2);
    PlanarFilter filter(white());
    drive(car, filter, 40);
    filter.propagate(Time::from_seconds(car.time() + seconds), {car.stamp(), 5, 0, 0, 0});
    return filter.estimate().covariance(0, 0);
  };
  EXPECT_LT(variance_after(1.01) - variance_after(0.99), 0.3);
}

TEST(PlanarFilter, KnowsTheWheelsAsSoonAsItsYaw) {
  Drive car(1);
  PlanarFilter filter(PlanarOptions{});
  while (!filter.estimate().yaw_known && car.time() < 60) drive(car, filter, 0.2);
  const PlanarEstimate now = filter.estimate();
  ASSERT_TRUE(now.yaw_known);
  EXPECT_LT(now.scale_sigma, 0.021);
  EXPECT_NEAR(now.scale, 1, 0.03);
}

TEST(PlanarFilter, ForgetsItsYawInALongGapAndFindsItAgain) {
  Drive car(2);
  PlanarFilter filter(PlanarOptions{});
  drive(car, filter, 60);
  EXPECT_TRUE(filter.estimate().yaw_known);
  PlanarOdometry held = car.go();
  for (int i = 0; i < 50; ++i) car.go();
  filter.propagate(car.stamp(), held);
  filter.update(car.observe());
  EXPECT_FALSE(filter.estimate().yaw_known);
  drive(car, filter, 60);
  const PlanarEstimate now = filter.estimate();
  EXPECT_TRUE(now.yaw_known);
  EXPECT_LT(std::abs(std::remainder(now.yaw - car.yaw(), 2 * M_PI)), 0.2);
  EXPECT_LT(off(car, filter), 8);
}

TEST(PlanarFilter, AMinuteWithoutOdometryEndsIt) {
  Drive car(2);
  PlanarFilter filter(PlanarOptions{});
  drive(car, filter, 20);
  PlanarOdometry held = car.go();
  for (int i = 0; i < 310; ++i) car.go();
  filter.propagate(car.stamp(), held);
  EXPECT_FALSE(filter.started());
  EXPECT_EQ(filter.tally().gaps, 1U);
  const auto counted = filter.tally().counted;
  drive(car, filter, 60);
  EXPECT_GT(filter.tally().counted, counted + 1000);
  EXPECT_LT(off(car, filter), 8);
}

TEST(PlanarFilter, ReflectedRangesAreDoubtedAndDoLittleHarm) {
  const auto error = [](double doubt, double late_share) {
    double sum = 0;
    for (unsigned seed = 0; seed < 5; ++seed) {
      Drive car(1, seed);
      car.late_share = late_share;
      PlanarOptions options;
      options.doubt = doubt;
      PlanarFilter filter(options);
      drive(car, filter, 60);
      sum += off(car, filter) / 5;
      if (doubt > 0 && late_share > 0) {
        EXPECT_GT(filter.tally().doubted, 800U);
      }
    }
    return sum;
  };
  const double clean = error(1, 0), doubted = error(1, 0.3), trusting = error(0, 0.3);
  EXPECT_LT(doubted, 2 * clean + 1);
  EXPECT_GT(trusting, 3 * doubted);
}

TEST(PlanarFilter, MillisecondJumpsOfTheClockAreFollowed) {
  Drive car(1);
  car.clock_jump = -3e-3 * gnss::kSpeedOfLight;
  PlanarFilter filter(PlanarOptions{});
  drive(car, filter, 40);
  EXPECT_EQ(filter.tally().clock_jumps, 1U);
  EXPECT_EQ(filter.tally().refused, 0U);
  EXPECT_LT(off(car, filter), 8);
}

TEST(PlanarFilter, AFilterThatIsWrongComesBack) {
  Drive car(1);
  PlanarFilter filter(PlanarOptions{});
  filter.start(car.stamp(), car.position() + Vector3d(9000, -4000, 0));
  drive(car, filter, 60);
  EXPECT_EQ(filter.tally().reacquired, 1U);
  EXPECT_LT(off(car, filter), 10);
}

TEST(PlanarFilter, EpochsOfNoUseAreCountedAndSurvived) {
  Drive car(1);
  PlanarFilter filter(PlanarOptions{});
  EXPECT_TRUE(filter.update(car.observe()).empty());  // not started
  drive(car, filter, 10);
  const PlanarVector before = filter.state();
  EXPECT_TRUE(filter.update(car.observe()).empty());  // again at the same time
  filter.update(*car.observe().fix);
  EXPECT_EQ(filter.tally().untimely, 2U);
  EXPECT_EQ(filter.state(), before);
  filter.propagate(Time::from_seconds(1), {});  // back in time
  EXPECT_EQ(filter.state(), before);
  filter.propagate(car.stamp(), car.go());
  RawEpoch none = car.observe();
  none.satellites.clear();
  EXPECT_TRUE(filter.update(none).empty());
  RawEpoch many = car.observe();
  many.time = Time::from_seconds(car.time() + 0.1);
  many.satellites.front().range = INFINITY;
  many.satellites[1].range.reset();
  while (many.satellites.size() < 100) many.satellites.push_back(many.satellites.front());
  EXPECT_EQ(filter.update(many).size(), kMostSatellites - 1);  // one has no range
  EXPECT_TRUE(filter.state().allFinite());
}

TEST(PlanarOptionsTest, RefusesNumbersThatMakeNoSense) {
  EXPECT_TRUE(check(PlanarOptions{}));
  PlanarOptions options;
  options.gate = NAN;
  ASSERT_FALSE(check(options));
  EXPECT_THAT(check(options).error().message, testing::HasSubstr("gate"));
}

}  // namespace
}  // namespace pade::navigation
