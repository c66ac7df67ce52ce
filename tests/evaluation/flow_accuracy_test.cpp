#include "pade/evaluation/flow_accuracy.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

TEST(FlowAccuracy, OfTheTruthItselfIsPerfect) {
  cv::Mat truth(9, 11, CV_32FC2);
  cv::randu(truth, -20, 20);
  const FlowAccuracy accuracy = flow_accuracy(truth, truth);
  EXPECT_EQ(accuracy.endpoint_error, 0);
  EXPECT_EQ(accuracy.angular_error, 0);
  EXPECT_EQ(accuracy.over_half, 0);
  EXPECT_EQ(accuracy.outliers, 0);
  EXPECT_EQ(accuracy.coverage, 1);
  EXPECT_EQ(accuracy.known, 99U);
}

TEST(FlowAccuracy, OfAConstantOffsetIsItsLength) {
  const cv::Mat truth(4, 4, CV_32FC2, cv::Scalar(100, 0));
  const FlowAccuracy accuracy = flow_accuracy(truth + cv::Scalar(-3, 4), truth);
  EXPECT_NEAR(accuracy.endpoint_error, 5, 1e-6);
  EXPECT_EQ(accuracy.over_three, 1);
  EXPECT_EQ(accuracy.outliers, 0) << "5 px is not more than 5 % of 100 px";
  EXPECT_EQ(flow_accuracy(truth + cv::Scalar(-3, 4.1), truth).outliers, 1);
}

TEST(FlowAccuracy, AngleIsMeasuredInSpaceTime) {
  const cv::Mat truth(2, 2, CV_32FC2, cv::Scalar(0, 0));
  const cv::Mat estimate(2, 2, CV_32FC2, cv::Scalar(1, 0));
  EXPECT_NEAR(flow_accuracy(estimate, truth).angular_error, 45, 1e-9);
}

TEST(FlowAccuracy, LeavesOutUnknownTruthAndCountsMissingEstimatesAsWrong) {
  cv::Mat truth(1, 4, CV_32FC2, cv::Scalar(1, 1));
  truth.at<cv::Vec2f>(0, 0) = {1.6e9F, 1.6e9F};
  truth.at<cv::Vec2f>(0, 1) = {kNone, kNone};
  cv::Mat estimate(1, 4, CV_32FC2, cv::Scalar(1, 1));
  estimate.at<cv::Vec2f>(0, 2) = {kNone, kNone};
  const FlowAccuracy accuracy = flow_accuracy(estimate, truth);
  EXPECT_EQ(accuracy.known, 2U);
  EXPECT_EQ(accuracy.coverage, 0.5);
  EXPECT_EQ(accuracy.endpoint_error, 0);
  EXPECT_EQ(accuracy.over_three, 0.5);
  const cv::Mat errors = endpoint_errors(estimate, truth);
  EXPECT_TRUE(std::isnan(errors.at<float>(0, 0)));
  EXPECT_TRUE(std::isnan(errors.at<float>(0, 2)));
  EXPECT_EQ(errors.at<float>(0, 3), 0);
}

TEST(FlowAccuracy, WithoutAnyTruthIsNotANumber) {
  const cv::Mat truth(1, 1, CV_32FC2, cv::Scalar(kNone, kNone));
  EXPECT_TRUE(std::isnan(flow_accuracy(truth, truth).endpoint_error));
}

TEST(FlowConfidenceAccuracy, OfAPerfectSigmaKeepsTheRightPixels) {
  const cv::Mat truth(10, 10, CV_32FC2, cv::Scalar(0, 0));
  cv::Mat estimate = truth.clone();
  estimate.rowRange(0, 2) = cv::Scalar(5, 0);  // a fifth is wrong
  cv::Mat sigma(10, 10, CV_32FC1, cv::Scalar(0.1));
  sigma.rowRange(0, 2) = 4;
  const FlowConfidenceAccuracy good = flow_confidence_accuracy(estimate, sigma, truth);
  EXPECT_EQ(good.kept_endpoint_error, 0);
  EXPECT_EQ(good.flagged, 1);
  EXPECT_EQ(good.trusted, 1);
  sigma = 4.1 - sigma;  // upside down
  const FlowConfidenceAccuracy bad = flow_confidence_accuracy(estimate, sigma, truth);
  EXPECT_NEAR(bad.kept_endpoint_error, 5 * 20.0 / 70, 1e-6);
  EXPECT_EQ(bad.flagged, 0);
  EXPECT_EQ(bad.trusted, 0);
}

}  // namespace
}  // namespace pade::evaluation
