#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "pade/simulation/flight/sensors/aiding.hpp"
#include "pade/simulation/flight/sensors/imu.hpp"

namespace pade::simulation {
namespace {

KinematicState at_rest(double seconds) {
  KinematicState state;
  state.time = Time::from_seconds(seconds);
  return state;
}

/// Overlapping Allan deviation at an averaging time of `m` samples (IEEE Std 952, Annex C).
double allan_deviation(const std::vector<double>& rate, std::size_t m, double dt) {
  std::vector<double> angle(rate.size() + 1, 0);
  for (std::size_t i = 0; i < rate.size(); ++i) angle[i + 1] = angle[i] + rate[i] * dt;
  double sum = 0;
  const std::size_t terms = angle.size() - 2 * m;
  for (std::size_t i = 0; i < terms; ++i) {
    const double second_difference = angle[i + 2 * m] - 2 * angle[i + m] + angle[i];
    sum += second_difference * second_difference;
  }
  const double tau = static_cast<double>(m) * dt;
  return std::sqrt(sum / (2 * tau * tau * static_cast<double>(terms)));
}

std::vector<double> gyroscope_at_rest(const TriadErrors& errors, double rate, double duration) {
  ImuModel model;
  model.gyroscope = errors;
  Imu imu(model, 7);
  std::vector<double> values;
  for (double t = 0; t < duration; t += 1 / rate) values.push_back(imu.sample(at_rest(t)).angular_rate.x());
  return values;
}

class WhiteNoise : public testing::TestWithParam<int> {};

TEST_P(WhiteNoise, HasAnAllanDeviationOfDensityOverRootTauAtAnySamplingRate) {
  const double rate = GetParam();
  const auto values = gyroscope_at_rest({.noise_density = 0.01}, rate, 2000);
  for (const double tau : {0.1, 1.0, 5.0}) {
    const auto m = static_cast<std::size_t>(std::lround(tau * rate));
    EXPECT_NEAR(allan_deviation(values, m, 1 / rate), 0.01 / std::sqrt(tau), 0.06 * 0.01 / std::sqrt(tau))
        << tau;
  }
}
INSTANTIATE_TEST_SUITE_P(Rates, WhiteNoise, testing::Values(50, 200),
                         [](const auto& parameter) { return "At" + std::to_string(parameter.param) + "Hz"; });

TEST(RandomWalkOfTheBias, HasAnAllanDeviationOfRootTauOverThree) {
  const auto values = gyroscope_at_rest({.random_walk = 0.01}, 50, 8000);
  for (const double tau : {1.0, 10.0}) {
    const double expected = 0.01 * std::sqrt(tau / 3);
    EXPECT_NEAR(allan_deviation(values, static_cast<std::size_t>(tau * 50), 0.02), expected, 0.1 * expected)
        << tau;
  }
}

TEST(GaussMarkov, HasTheStatedVarianceAndAnExponentialAutocorrelation) {
  Random random(3);
  const double tau = 2;
  const double dt = 0.1;
  GaussMarkov3 process(Eigen::Vector3d(1, 2, 3), tau, random);
  std::vector<Eigen::Vector3d> values;
  for (int i = 0; i < 200'000; ++i) values.push_back(process.step(dt, random));
  for (const std::size_t lag : {0u, 10u, 20u, 40u}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i + lag < values.size(); ++i) sum += values[i].cwiseProduct(values[i + lag]);
    const Eigen::Vector3d correlation =
        (sum / static_cast<double>(values.size() - lag)).cwiseQuotient(Eigen::Vector3d(1, 4, 9));
    const double expected = std::exp(-static_cast<double>(lag) * dt / tau);
    EXPECT_LT((correlation.array() - expected).abs().maxCoeff(), 0.05) << "lag " << lag;
  }
}

TEST(Imu, AtRestShowsGravityUpwardsAndNoRotation) {
  Imu imu(ImuModel::perfect(), 1);
  const ImuSample sample = imu.sample(at_rest(0));
  EXPECT_LT((sample.specific_force - Eigen::Vector3d(0, 0, 9.80665)).norm(), 1e-12);
  EXPECT_LT(sample.angular_rate.norm(), 1e-12);
}

TEST(Imu, SaturatesAtItsRangeAndQuantisesToItsResolution) {
  ImuModel model;
  model.gyroscope = {.range = 1, .resolution = 0.25};
  Imu imu(model, 1);
  KinematicState state = at_rest(0);
  state.angular_velocity = {7, -7, 0.3};
  EXPECT_LT((imu.sample(state).angular_rate - Eigen::Vector3d(1, -1, 0.25)).norm(), 1e-12);
}

TEST(Imu, GivesTheSameBitsForTheSameSeedAndOthersForAnother) {
  Imu a(ImuModel::industrial(), 5);
  Imu b(ImuModel::industrial(), 5);
  Imu c(ImuModel::industrial(), 6);
  for (int i = 0; i < 100; ++i) {
    const auto state = at_rest(0.005 * i);
    const ImuSample first = a.sample(state);
    EXPECT_EQ(first.specific_force, b.sample(state).specific_force);
    EXPECT_NE(first.specific_force, c.sample(state).specific_force);
  }
}

TEST(Gnss, SeesTheAntennaAndItsMotionWhenTheBodyTurns) {
  GnssModel model;
  model.white_horizontal = model.white_vertical = model.bias_horizontal = model.bias_vertical = 0;
  model.velocity_horizontal = model.velocity_vertical = 0;
  model.lever_arm = {0.5, 0, 0.1};
  Gnss gnss(model, 1);
  KinematicState state = at_rest(0);
  state.R_world_body = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());  // facing north
  state.angular_velocity = {0, 0, 2};
  const GnssEpoch epoch = gnss.sample(state);
  EXPECT_LT((epoch.fix.position - Eigen::Vector3d(0, 0.5, 0.1)).norm(), 1e-12);
  EXPECT_LT((epoch.velocity.velocity - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-12);
}

TEST(Gnss, ErrorsHaveTheReportedCovariance) {
  GnssModel model = GnssModel::single_point();
  model.bias_correlation_time = 5;
  Gnss gnss(model, 2);
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  GnssEpoch epoch;
  const int count = 40'000;
  for (int i = 0; i < count; ++i) {
    epoch = gnss.sample(at_rest(0.5 * i));
    position += epoch.fix.position.cwiseAbs2() / count;
    velocity += epoch.velocity.velocity.cwiseAbs2() / count;
  }
  EXPECT_LT((position.cwiseQuotient(epoch.fix.covariance.diagonal()).array() - 1).abs().maxCoeff(), 0.08);
  EXPECT_LT((velocity.cwiseQuotient(epoch.velocity.covariance.diagonal()).array() - 1).abs().maxCoeff(),
            0.05);
}

TEST(Gnss, OutliersComeAtTheStatedRateAndLeaveTheOtherEpochsAlone) {
  GnssModel model = GnssModel::carrier_phase();
  Gnss clean(model, 4);
  model.outlier_fraction = 0.1;
  Gnss dirty(model, 4);
  int outliers = 0;
  for (int i = 0; i < 5000; ++i) {
    const auto state = at_rest(0.2 * i);
    outliers += clean.sample(state).fix.position != dirty.sample(state).fix.position;
  }
  EXPECT_NEAR(outliers, 500, 70);
}

TEST(Magnetometer, PointsNorthWhereTheBodyFacesNorth) {
  MagnetometerModel model;
  model.white = model.hard_iron = 0;
  Magnetometer magnetometer(model, 1);
  KinematicState state = at_rest(0);
  state.R_world_body = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d field = magnetometer.sample(state).field;
  EXPECT_GT(field.x(), 0);
  EXPECT_NEAR(field.y(), 0, 1e-12);
}

TEST(Barometer, DriftsSlowlyAboutItsTurnOnBias) {
  BarometerModel model;
  model.white = 0;
  Barometer barometer(model, 8);
  const double first = barometer.sample(at_rest(0)).height;
  EXPECT_NEAR(barometer.sample(at_rest(1)).height, first, 6 * 0.5 * std::sqrt(2.0 / 300));
  EXPECT_NE(barometer.sample(at_rest(300)).height, first);
}

}  // namespace
}  // namespace pade::simulation
