// The accuracy figures follow the protocol of docs/method.md.
#include "pade/evaluation/depth_accuracy.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/evaluation/log_histogram.hpp"

#include "evaluation/synthetic_depth.hpp"

namespace pade::evaluation {
namespace {

constexpr float kNoDepth = std::numeric_limits<float>::quiet_NaN();
constexpr double kBucket = 1.0 / 2048;

cv::Mat row(std::initializer_list<float> values) {
  return cv::Mat(std::vector<float>(values), true).reshape(1, 1);
}

DepthImage estimate_of(const cv::Mat& depth, const cv::Mat& variance = {}) {
  return {{}, 1, depth, variance, cv::Mat(depth.size(), CV_8UC1, cv::Scalar(0))};
}

double exact_median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

TEST(LogHistogram, MedianIsThatOfTheSortedValues) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> spread(-2, 2);
  LogHistogram histogram;
  std::vector<double> values;
  for (int i = 0; i < 20001; ++i) {
    values.push_back(static_cast<float>(spread(random)));
    histogram.add(static_cast<float>(values.back()));
  }
  EXPECT_NEAR(histogram.median() / exact_median(values), 1, kBucket);
  std::sort(values.begin(), values.end());
  EXPECT_NEAR(histogram.quantile(0.99) / values[19800], 1, 2 * kBucket);
}

TEST(LogHistogram, HoldsAnyValueAndNone) {
  LogHistogram histogram;
  EXPECT_TRUE(std::isnan(histogram.median()));
  for (const float value : {0.0F, -1.0F, 1e-40F}) histogram.add(value);
  EXPECT_LT(histogram.median(), 1e-7);
  LogHistogram large;
  for (const float value : {1e30F, std::numeric_limits<float>::infinity()}) large.add(value);
  EXPECT_GE(large.median(), 65536);
}

// The protocol, written out a second time in the plainest way.
struct Plain {
  std::vector<double> errors, relatives, normalised;
  std::uint64_t truth = 0;
};
Plain plain_range(const DepthImage& estimate, const cv::Mat& truth, double from, double to,
                  double max_depth) {
  Plain plain;
  const DepthImage full = at_full_size(estimate, truth.size());
  for (int i = 0; i < truth.rows * truth.cols; ++i) {
    const double true_depth = truth.at<float>(i / truth.cols, i % truth.cols);
    const double depth = full.depth.at<float>(i / truth.cols, i % truth.cols);
    const double variance = full.variance.at<float>(i / truth.cols, i % truth.cols);
    if (!(true_depth >= from && true_depth < to)) continue;
    ++plain.truth;
    if (std::isnan(depth) || depth <= 0 || depth > max_depth) continue;
    plain.errors.push_back(std::abs(depth - true_depth));
    plain.relatives.push_back(std::abs(depth - true_depth) / true_depth);
    plain.normalised.push_back(std::abs(depth - true_depth) / std::sqrt(variance));
  }
  return plain;
}
double mean_of(const std::vector<double>& values, double power = 1) {
  double sum = 0;
  for (const double value : values) sum += std::pow(value, power);
  return sum / static_cast<double>(values.size());
}
double share_of(const std::vector<double>& values, double limit) {
  return static_cast<double>(
             std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; })) /
         static_cast<double>(values.size());
}

class DepthAccuracyOfWindow : public testing::TestWithParam<int> {};

TEST_P(DepthAccuracyOfWindow, IsThePlainProtocol) {
  const cv::Mat truth = test::truth_ramp({101, 67});
  const DepthImage estimate = test::noisy_estimate(truth, 0.2, 3, GetParam());
  Accumulator accumulator(20);
  accumulator.add(estimate, truth);
  const DepthAccuracy accuracy = accumulator.result();
  std::vector<RangeAccuracy> rows(accuracy.ranges.begin(), accuracy.ranges.end());
  rows.push_back(accuracy.all);
  for (const RangeAccuracy& range : rows) {
    SCOPED_TRACE(range.from);
    const Plain plain = plain_range(estimate, truth, range.from, range.to, 20);
    ASSERT_EQ(range.truth_pixels, plain.truth);
    ASSERT_EQ(range.pixels, plain.errors.size());
    ASSERT_GT(range.pixels, 100U);
    EXPECT_DOUBLE_EQ(range.coverage,
                     static_cast<double>(plain.errors.size()) / static_cast<double>(plain.truth));
    EXPECT_NEAR(range.mean, mean_of(plain.errors), 1e-6);
    EXPECT_NEAR(range.deviation, std::sqrt(mean_of(plain.errors, 2) - std::pow(mean_of(plain.errors), 2)),
                1e-5);
    EXPECT_NEAR(range.median / exact_median(plain.errors), 1, 0.01);
    EXPECT_NEAR(range.relative_mean, mean_of(plain.relatives), 1e-6);
    EXPECT_NEAR(range.relative_median / exact_median(plain.relatives), 1, 0.01);
    EXPECT_NEAR(range.outliers, 1 - share_of(plain.relatives, 0.25), 1e-9);
    EXPECT_EQ(range.sigma_pixels, range.pixels);
    EXPECT_NEAR(range.within_1_sigma, share_of(plain.normalised, 1), 1e-9);
    EXPECT_NEAR(range.within_2_sigma, share_of(plain.normalised, 2), 1e-9);
    EXPECT_NEAR(range.rms_of_sigma, std::sqrt(mean_of(plain.normalised, 2)), 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, DepthAccuracyOfWindow, testing::Values(1, 4, 8),
                         [](const auto& instance) { return testing::PrintToString(instance.param); });

TEST(DepthAccuracy, CallsNormalErrorsOfTheStatedSigmaCalibrated) {
  const cv::Mat truth = test::truth_ramp({320, 240});
  Accumulator accumulator;
  for (unsigned seed = 0; seed < 4; ++seed) accumulator.add(test::noisy_estimate(truth, 0.05, seed), truth);
  const RangeAccuracy all = accumulator.result().all;
  EXPECT_NEAR(all.within_1_sigma, 0.683, 0.005);
  EXPECT_NEAR(all.within_2_sigma, 0.954, 0.005);
  EXPECT_NEAR(all.rms_of_sigma, 1, 0.01);
}

TEST(DepthAccuracy, BinsByTruthWithTheLimitInTheFartherRange) {
  Accumulator accumulator;
  accumulator.add(estimate_of(row({99, 99, 99, 99})), row({3.999F, 4, 12, 16}));
  const auto ranges = accumulator.result().ranges;
  EXPECT_EQ(ranges[0].pixels, 1U);
  EXPECT_EQ(ranges[1].pixels, 1U);
  EXPECT_EQ(ranges[2].pixels, 0U);
  EXPECT_EQ(ranges[3].pixels, 1U);
  EXPECT_EQ(ranges[4].pixels, 1U);
}

TEST(DepthAccuracy, NoDepthLowersTheCoverageAndNothingElse) {
  Accumulator accumulator(20);
  accumulator.add(estimate_of(row({kNoDepth, 0, -2, 20.001F, 3})), row({2, 2, 2, 2, 2}));
  const RangeAccuracy range = accumulator.result().ranges[0];
  EXPECT_DOUBLE_EQ(range.coverage, 0.2);
  EXPECT_DOUBLE_EQ(range.mean, 1);
  EXPECT_DOUBLE_EQ(range.deviation, 0);
  EXPECT_DOUBLE_EQ(range.outliers, 1);
}

TEST(DepthAccuracy, PixelsWithoutTruthDoNotCount) {
  Accumulator accumulator;
  accumulator.add(estimate_of(row({1, 1, 1, 1})),
                  row({kNoDepth, 0, std::numeric_limits<float>::infinity(), -1}));
  EXPECT_EQ(accumulator.result().all.truth_pixels, 0U);
  EXPECT_TRUE(std::isnan(accumulator.result().all.coverage));
  EXPECT_TRUE(std::isnan(accumulator.result().all.deviation));
}

TEST(DepthAccuracy, DoesNotDependOnTheOrderOfFrames) {
  const cv::Mat truth = test::truth_ramp({40, 30});
  Accumulator forward, backward;
  for (unsigned i = 0; i < 3; ++i) {
    forward.add(test::noisy_estimate(truth, 0.1, i), truth);
    backward.add(test::noisy_estimate(truth, 0.1, 2 - i), truth);
  }
  EXPECT_EQ(forward.result().all.median, backward.result().all.median);
  EXPECT_NEAR(forward.result().all.mean, backward.result().all.mean, 1e-12);
}

TEST(DepthAccuracy, AveragesSequencesNotPixels) {
  Accumulator large, small;
  large.add(estimate_of(row({3, 3, 3, 3})), row({2, 2, 2, 2}));
  small.add(estimate_of(row({4})), row({1}));
  const std::array both = {large.result(), small.result()};
  const DepthAccuracy mean = average(both);
  EXPECT_DOUBLE_EQ(mean.all.mean, 2);
  EXPECT_EQ(mean.all.pixels, 5U);
  EXPECT_EQ(mean.frames, 2);
  EXPECT_TRUE(std::isnan(mean.ranges[1].mean)) << "no sequence has pixels there";
}

TEST(DepthAccuracy, OfSequencesWithSeveralLimitsStatesNone) {
  DepthAccuracy near, far;
  near.max_depth = 10;
  far.max_depth = 40;
  const auto limit = [](std::initializer_list<DepthAccuracy> all) {
    return average(std::vector<DepthAccuracy>(all)).max_depth;
  };
  EXPECT_EQ(limit({near, near, near}), 10);
  EXPECT_TRUE(std::isnan(limit({near, far})));
  EXPECT_TRUE(std::isnan(limit({near, far, near})));
  EXPECT_TRUE(std::isnan(limit({near, near, DepthAccuracy{}}))) << "one without a limit";
}

TEST(RelativeError, IsSignedAndNaNWhereUnknown) {
  const cv::Mat error = relative_error(estimate_of(row({3, 1, kNoDepth, 1})), row({2, 2, 2, kNoDepth}));
  EXPECT_FLOAT_EQ(error.at<float>(0), 0.5F);
  EXPECT_FLOAT_EQ(error.at<float>(1), -0.5F);
  EXPECT_TRUE(std::isnan(error.at<float>(2)));
  EXPECT_TRUE(std::isnan(error.at<float>(3)));
}

}  // namespace
}  // namespace pade::evaluation
