#include "pade/checks/scene_hardness.hpp"

#include <array>
#include <limits>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace pade::evaluation {
namespace {

TEST(SceneHardness, CountsEachDepthRangeAndTheNearest) {
  cv::Mat depth(10, 60, CV_32FC1);
  const std::array<float, 6> depths{1.4F, 4, 8.5F, 16, 30, std::numeric_limits<float>::quiet_NaN()};
  for (int i = 0; i < 6; ++i)
    depth.colRange(10 * i, 10 * i + 10) = static_cast<double>(depths[static_cast<std::size_t>(i)]);
  const SceneHardness counts = scene_hardness(cv::Mat::zeros(10, 60, CV_8UC1), depth);
  EXPECT_EQ(counts.pixels, 600);
  EXPECT_EQ(counts.in_range[0], 200) << "1.4 m and 4 m";
  EXPECT_EQ(counts.in_range[1], 0);
  EXPECT_EQ(counts.in_range[2], 100);
  EXPECT_EQ(counts.in_range[3], 100) << "16 m";
  EXPECT_EQ(counts.beyond, 100);
  ASSERT_TRUE(counts.nearest.has_value());
  EXPECT_FLOAT_EQ(static_cast<float>(*counts.nearest), 1.4F);
}

TEST(SceneHardness, ARampIsFlatBelowTheStatedGradient) {
  const cv::Mat depth(20, 40, CV_32FC1, cv::Scalar(5));
  for (const int slope : {3, 5}) {
    cv::Mat image(20, 40, CV_8UC1);
    for (int u = 0; u < 40; ++u) image.col(u) = slope * u;
    const SceneHardness counts = scene_hardness(image, depth);
    // The mirrored border halves the gradient of the first and the last column.
    EXPECT_EQ(counts.flat, slope == 3 ? 800 : 40);
    EXPECT_EQ(counts.near_edge, 0);
  }
}

TEST(SceneHardness, AnEdgeReachesThreePixelsToEitherSide) {
  cv::Mat depth(20, 40, CV_32FC1, cv::Scalar(5));
  depth.colRange(20, 40) = 8;
  // A slope of the ground is no edge, whatever its extent.
  cv::Mat ground = depth.rowRange(10, 20);
  for (int v = 0; v < 10; ++v) ground.row(v) = 5 + 0.2 * v;
  const SceneHardness counts = scene_hardness(cv::Mat(20, 40, CV_8UC3, cv::Scalar::all(90)), depth);
  // Found at column 19 (against 20) and, where the wall ends on the ground, at row 9.
  EXPECT_GE(counts.near_edge, 7 * 10);
  EXPECT_LE(counts.near_edge, 7 * 13 + 7 * 24);
  cv::Mat smooth(20, 40, CV_32FC1);
  for (int u = 0; u < 40; ++u) smooth.col(u) = 2 + 0.15 * u;
  EXPECT_EQ(scene_hardness(cv::Mat::zeros(20, 40, CV_8UC1), smooth).near_edge, 0);
}

TEST(SceneHardness, AddsUp) {
  const cv::Mat image = cv::Mat::zeros(8, 8, CV_8UC1);
  SceneHardness sum = scene_hardness(image, cv::Mat(8, 8, CV_32FC1, cv::Scalar(3)));
  sum += scene_hardness(image, cv::Mat(8, 8, CV_32FC1, cv::Scalar(2)));
  EXPECT_EQ(sum.pixels, 128);
  EXPECT_EQ(sum.share(sum.in_range[0]), 1);
  EXPECT_EQ(*sum.nearest, 2);
}

}  // namespace
}  // namespace pade::evaluation
