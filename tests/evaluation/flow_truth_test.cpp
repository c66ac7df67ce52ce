#include "pade/evaluation/flow_truth.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

Camera camera() {
  Camera pinhole;
  pinhole.width = 64;
  pinhole.height = 48;
  pinhole.fx = 50;
  pinhole.fy = 60;
  pinhole.cx = 31.5;
  pinhole.cy = 23.5;
  return pinhole;
}

Pose moved_by(double x, double y, double z) {
  Pose pose;
  pose.translation = {x, y, z};
  return pose;
}

TEST(FlowFromDepth, OfASidewaysMotionIsFocalLengthTimesMotionOverDepth) {
  const cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(4));
  const cv::Mat flow = flow_from_depth(camera(), depth, Pose(), moved_by(0.16, -0.2, 0));
  const auto& w = flow.at<cv::Vec2f>(20, 30);
  EXPECT_NEAR(w[0], -50 * 0.16 / 4, 1e-5);
  EXPECT_NEAR(w[1], 60 * 0.2 / 4, 1e-5);
  EXPECT_TRUE(std::isnan(flow.at<cv::Vec2f>(20, 1)[0])) << "leaves the image on the left";
}

TEST(FlowFromDepth, OfAForwardMotionPointsAwayFromTheFocusOfExpansion) {
  const cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(5));
  const cv::Mat flow = flow_from_depth(camera(), depth, Pose(), moved_by(0, 0, 1));
  for (int v = 15; v < 33; ++v) {
    for (int u = 15; u < 48; ++u) {
      const auto& w = flow.at<cv::Vec2f>(v, u);
      EXPECT_NEAR(w[0], (u - 31.5) / 4, 1e-4);
      EXPECT_NEAR(w[1], (v - 23.5) / 4, 1e-4);
    }
  }
}

TEST(FlowFromDepth, IsUnknownWithoutDepthAndBehindTheCamera) {
  cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(2));
  depth.at<float>(10, 10) = std::nanf("");
  depth.at<float>(10, 11) = 0;
  const cv::Mat still = flow_from_depth(camera(), depth, Pose(), Pose());
  EXPECT_TRUE(std::isnan(still.at<cv::Vec2f>(10, 10)[0]));
  EXPECT_TRUE(std::isnan(still.at<cv::Vec2f>(10, 11)[1]));
  EXPECT_NEAR(still.at<cv::Vec2f>(10, 12)[0], 0, 1e-5);
  const cv::Mat passed = flow_from_depth(camera(), depth, Pose(), moved_by(0, 0, 3));
  EXPECT_EQ(cv::countNonZero(passed.reshape(1) == passed.reshape(1)), 0);
}

}  // namespace
}  // namespace pade::evaluation
