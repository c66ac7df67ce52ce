#include "pade/depth/motion/baseline_window.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

const Eigen::Vector3d kForward(0, 0, -1);

RelativeMotion step(const Eigen::Vector3d& t, double sigma) {
  RelativeMotion motion;
  motion.t_reference_other = t;
  motion.covariance.topLeftCorner<3, 3>() = sigma * sigma * Eigen::Matrix3d::Identity();
  return motion;
}

/// A flight whose true steps are known, and what a user of the window keeps: the lengths that it believes.
struct Flight {
  explicit Flight(int steps) : window(steps) {}
  BaselineWindow window;
  std::vector<double> lengths;  // believed
  std::vector<double> truth;

  /// @param given  by GPS/INS. @param ratio_error  of what the images say. @param span  of the depth's
  /// baseline
  void fly(double true_length, double given, double sigma, double ratio_error, std::size_t span) {
    std::optional<BaselineWindow::Seen> seen;
    if (!lengths.empty()) {
      span = std::min(span, lengths.size());
      const double believed =
          std::accumulate(lengths.end() - static_cast<std::ptrdiff_t>(span), lengths.end(), 0.0);
      const double is = std::accumulate(truth.end() - static_cast<std::ptrdiff_t>(span), truth.end(), 0.0);
      seen = {true_length * believed / is * std::exp(ratio_error), 1e-5, static_cast<int>(span)};
    }
    const std::vector<double> factors = window.push(step(given * kForward, sigma), kForward, seen);
    for (std::size_t i = 0; i < factors.size(); ++i)
      lengths[lengths.size() - factors.size() + i] *= factors[i];
    lengths.push_back(window.length());
    truth.push_back(true_length);
  }
};

TEST(BaselineWindow, ExactLengthsStay) {
  Flight flight(8);
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const double length = random.uniform(0.05, 0.3);
    flight.fly(length, length, 0, 0.01 * random.normal(), 4);
    for (std::size_t k = 0; k < flight.lengths.size(); ++k)
      EXPECT_NEAR(flight.lengths[k] / flight.truth[k], 1, 1e-5);
  }
  EXPECT_LT(flight.window.variance(), 1e-9);
}

TEST(BaselineWindow, ForgettingIsMarginalising) {
  // A window that forgets knows as much of the newest step as one that does not.
  Flight small(6);
  Flight large(100);
  Random random(2);
  for (int i = 0; i < 40; ++i) {
    const double length = random.uniform(0.1, 0.3);
    const double given = length * (1 + 0.2 * random.uniform(-1, 1));
    const double error = 0.003 * random.normal();
    small.fly(length, given, 0.11 * given, error, 5);
    large.fly(length, given, 0.11 * given, error, 5);
    EXPECT_NEAR(small.lengths.back() / large.lengths.back(), 1, 1e-6);
  }
}

TEST(BaselineWindow, ErrorsOfSingleStepsAverageOutAndTheVarianceSaysSo) {
  double squared = 0;
  double stated = 0;
  constexpr int kFlights = 200;
  for (int k = 0; k < kFlights; ++k) {
    Flight flight(16);
    Random random(static_cast<std::uint64_t>(k) + 1);
    for (int i = 0; i < 60; ++i)
      flight.fly(0.2, 0.2 * std::exp(0.1 * random.normal()), 0.02, 0.003 * random.normal(), 8);
    squared += std::pow(std::log(flight.lengths.back() / 0.2), 2);
    stated += flight.window.variance();
  }
  EXPECT_LT(std::sqrt(squared / kFlights), 0.1 / 4);
  EXPECT_GT(stated / squared, 0.7);
  EXPECT_LT(stated / squared, 3);
}

TEST(BaselineWindow, AnErrorThatAllStepsShareStaysAndTheVarianceSaysSo) {
  double squared = 0;
  double stated = 0;
  constexpr int kFlights = 200;
  for (int k = 0; k < kFlights; ++k) {
    Flight flight(16);
    Random random(static_cast<std::uint64_t>(k) + 1);
    const double common = 1 + 0.02 * random.normal();
    for (int i = 0; i < 30; ++i) flight.fly(0.2, 0.2 * common, 0.004, 0.001 * random.normal(), 8);
    squared += std::pow(std::log(flight.lengths.back() / 0.2), 2);
    stated += flight.window.variance();
  }
  EXPECT_GT(stated / squared, 0.7);
  EXPECT_LT(stated / squared, 1.4);
}

TEST(BaselineWindow, UnevenStepsCountByTheirLength) {
  // A depth from a hover and one long step has the scale of the long one.
  Flight flight(16);
  Random random(3);
  for (int i = 0; i < 24; ++i) {
    const bool hover = i % 3 != 0;
    const double length = hover ? 0.002 : 0.3;
    flight.fly(length, hover ? 0.02 : 0.3, hover ? 0.03 : 0.0003, 0, 8);
    if (i >= 3) {
      EXPECT_NEAR(flight.lengths.back() / length, 1, 0.02) << i;
    }
  }
}

/// An outage of the satellites over a vehicle that hovers: what GPS/INS says of steps of a centimetre is off
/// by several, more and more. The images hand the scale of the flight before on, and the variance says so.
TEST(BaselineWindow, AHoverKeepsTheScaleOfTheFlightBeforeAndTheVarianceSaysSo) {
  double squared = 0;
  double stated = 0;
  constexpr int kFlights = 200;
  for (int k = 0; k < kFlights; ++k) {
    Flight flight(16);
    Random random(static_cast<std::uint64_t>(k) + 1);
    const double common = std::exp(0.02 * random.normal());
    for (int i = 0; i < 40; ++i)
      flight.fly(0.2, 0.2 * common * std::exp(0.03 * random.normal()), 0.2 * std::hypot(0.02, 0.03),
                 0.003 * random.normal(), 8);
    const double drift = random.normal();
    for (int i = 0; i < 60; ++i) {
      const double sigma = 0.02 + 0.001 * i;
      flight.fly(0.01, std::abs(0.01 + sigma * drift), sigma, 0.003 * random.normal(), 8);
    }
    squared += std::pow(std::log(flight.lengths.back() / 0.01), 2);
    stated += flight.window.variance();
  }
  EXPECT_LT(std::sqrt(squared / kFlights), 0.05);
  EXPECT_GT(stated / squared, 0.3);  // that all of its lengths are off to one side is not foreseen
  EXPECT_LT(stated / squared, 3);
}

TEST(BaselineWindow, GivenAcrossTheDirectionItIsTheLengthAlongItThatCounts) {
  // 3 cm of noise make a step of 20 cm longer on the average; its part along the true direction they do not.
  Random random(4);
  double sum = 0;
  constexpr int kSteps = 4000;
  for (int i = 0; i < kSteps; ++i) {
    BaselineWindow window(1);
    window.push(step(0.2 * kForward + 0.03 * random.normal3(), 0.03), kForward, {});
    sum += window.length();
  }
  EXPECT_NEAR(sum / kSteps, 0.2, 0.002);
}

TEST(BaselineWindow, AStepThatTheImagesContradictCountsForLittle) {
  Flight flight(8);
  for (int i = 0; i < 6; ++i) flight.fly(0.2, 0.2, 0.004, 0, 4);
  BaselineWindow& window = flight.window;
  window.push(step(Eigen::Vector3d(0.2, 0, 0.01), 0.004), kForward, BaselineWindow::Seen{0.1, 1e-5, 4});
  EXPECT_NEAR(window.length(), 0.1, 0.002);
}

/// A step that GPS/INS and the steps before contradict is a surprise; one within their errors is none.
TEST(BaselineWindow, IsSurprisedByALengthThatNobodyElseHas) {
  Flight flight(8);
  Random random(7);
  constexpr double kSigma = 0.003;
  for (int i = 0; i < 8; ++i)
    flight.fly(0.1, 0.1 + kSigma * random.normal(), kSigma, 0.003 * random.normal(), 4);
  const RelativeMotion given = step(0.05 * kForward, kSigma);
  EXPECT_LT(flight.window.surprise(given, kForward, {0.052, 1e-4, 4}), 4);
  EXPECT_GT(flight.window.surprise(given, kForward, {0.025, 1e-4, 4}), 25);
  EXPECT_GT(flight.window.surprise(given, kForward, {0.09, 1e-4, 4}), 25);
  // GPS/INS that knows nothing of the length contradicts nothing.
  EXPECT_LT(flight.window.surprise(step(0.05 * kForward, 0.1), kForward, {0.025, 1e-4, 4}), 1);
  EXPECT_EQ(BaselineWindow(8).surprise(given, kForward, {0.025, 1e-4, 4}), 0);
  // Nor does one that only knows that a vehicle stands, whatever the logarithm of its residual motion.
  RelativeMotion still = step({0.02, 0.02, 0}, 0.06);
  still.covariance(2, 2) = 0.004 * 0.004;
  EXPECT_LT(flight.window.surprise(still, kForward, {0.0008, 1e-4, 4}), 1);
}

}  // namespace
}  // namespace pade::depth
