#include "pade/io/formats/flow_picture.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace pade::io {
namespace {

cv::Vec3b color_of(float u, float v, double full_scale = 1) {
  return flow_colors(cv::Mat(1, 1, CV_32FC2, cv::Scalar(u, v)), full_scale).at<cv::Vec3b>(0, 0);
}

// Hue angles of the published wheel: right is red, down is yellow to green, left is blue-cyan, up is violet.
TEST(FlowColors, NameTheDirection) {
  EXPECT_EQ(color_of(0, 0), cv::Vec3b(255, 255, 255));
  const cv::Vec3b right = color_of(1, 0);
  EXPECT_EQ(right[2], 255);
  EXPECT_LT(right[1], 40);
  const cv::Vec3b left = color_of(-1, 0);
  EXPECT_EQ(left[0], 255);
  EXPECT_EQ(left[2], 0);
  const cv::Vec3b down = color_of(0, 1);
  EXPECT_GT(down[1], 200);
  EXPECT_EQ(down[0], 0);
  const cv::Vec3b up = color_of(0, -1);
  EXPECT_EQ(up[0], 255);
  EXPECT_GT(up[2], 50);
}

TEST(FlowColors, FadeToWhiteWithLengthAndDarkenBeyondTheScale) {
  int last = 255 * 3 + 1;
  for (const float length : {0.0F, 0.25F, 0.5F, 0.75F, 1.0F}) {
    const cv::Vec3b color = color_of(length * 4, 0, 4);
    const int sum = color[0] + color[1] + color[2];
    EXPECT_LT(sum, last);
    last = sum;
  }
  EXPECT_LT(color_of(1.01F, 0)[2], 255);
}

TEST(FlowColors, UnknownIsBlack) {
  EXPECT_EQ(color_of(std::numeric_limits<float>::quiet_NaN(), 0), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(color_of(0, std::numeric_limits<float>::infinity()), cv::Vec3b(0, 0, 0));
}

TEST(FlowPicture, ShowsTheFieldUnchangedBesideItsWheel) {
  cv::Mat flow(120, 30, CV_32FC2, cv::Scalar(0.5, -0.25));
  const cv::Mat picture = flow_picture(flow, 1);
  EXPECT_EQ(cv::norm(picture(cv::Rect(0, 0, 30, 120)), flow_colors(flow, 1), cv::NORM_INF), 0);
  // The wheel's centre is white, its right rim is the colour of motion to the right.
  const cv::Mat panel = picture.colRange(30, picture.cols);
  EXPECT_EQ(panel.at<cv::Vec3b>(48, 48), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(panel.at<cv::Vec3b>(48, 88), color_of(1, 0));
}

TEST(FlowPicture, ExistsForFieldsOfAnySize) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 200), cv::Size(200, 1)}) {
    const cv::Mat flow(size, CV_32FC2, cv::Scalar::all(std::numeric_limits<float>::quiet_NaN()));
    const cv::Mat picture = flow_picture(flow);
    EXPECT_GE(picture.rows, size.height);
    EXPECT_GT(picture.cols, size.width);
  }
}

TEST(FlowFullScale, IgnoresSingleOutliers) {
  cv::Mat flow(100, 100, CV_32FC2, cv::Scalar(3, 0));
  flow.at<cv::Vec2f>(5, 5) = {1000, 0};
  EXPECT_EQ(flow_full_scale(flow), 5);
  EXPECT_EQ(flow_full_scale(cv::Mat(10, 10, CV_32FC2, cv::Scalar(0, 0.1))), 0.1);
}

}  // namespace
}  // namespace pade::io
