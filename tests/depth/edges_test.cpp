#include "pade/depth/edges.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace pade::depth {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);

/// Every pixel measured, with 2 % sigma and a bound at 90 % of its depth.
DepthImage measured(const cv::Mat& depth) {
  DepthImage image;
  image.depth = depth.clone();
  image.variance = 4e-4 * depth.mul(depth);
  image.own_variance = 0.5 * image.variance;
  image.bound = 0.9 * depth;
  image.state = cv::Mat(depth.size(), CV_8UC1, cv::Scalar(kMeasured));
  return image;
}

/// Near on the left of column `edge`, far on the right, and a ramp of `blur` pixels between them.
cv::Mat step_edge(float near, float far, int edge, int blur) {
  cv::Mat depth(30, 80, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const float share =
          std::clamp(static_cast<float>(u - edge + 1) / static_cast<float>(blur + 1), 0.0F, 1.0F);
      depth.at<float>(v, u) = near + share * (far - near);
    }
  }
  return depth;
}

/// What the options promise, pixel by pixel.
void expect_guarded(const DepthImage& before, const DepthImage& after, const EdgeOptions& options) {
  const cv::Rect all({0, 0}, before.depth.size());
  for (int v = 0; v < before.depth.rows; ++v) {
    for (int u = 0; u < before.depth.cols; ++u) {
      float nearest = std::numeric_limits<float>::infinity();
      float first_end = nearest;
      for (int dv = -options.radius; dv <= options.radius; ++dv) {
        for (int du = -options.radius; du <= options.radius; ++du) {
          if (!all.contains({u + du, v + dv}) || before.state.at<std::uint8_t>(v + dv, u + du) != kMeasured)
            continue;
          nearest = std::min(nearest, before.depth.at<float>(v + dv, u + du));
          const float bound = before.bound.at<float>(v + dv, u + du);
          if (!std::isnan(bound)) first_end = std::min(first_end, bound);
        }
      }
      const float z = before.depth.at<float>(v, u);
      const bool was = before.state.at<std::uint8_t>(v, u) == kMeasured;
      const bool keeps = was && !(nearest < static_cast<float>(options.nearness) * z);
      EXPECT_EQ(after.state.at<std::uint8_t>(v, u), keeps ? kMeasured
                                                    : was
                                                        ? static_cast<std::uint8_t>(DepthState::inconsistent)
                                                        : before.state.at<std::uint8_t>(v, u));
      if (keeps) {
        EXPECT_EQ(after.depth.at<float>(v, u), z);
      } else {
        EXPECT_TRUE(std::isnan(after.depth.at<float>(v, u)) && std::isnan(after.variance.at<float>(v, u)) &&
                    std::isnan(after.own_variance.at<float>(v, u)));
      }
      const float bound = before.bound.at<float>(v, u);
      if (std::isnan(bound)) {
        EXPECT_TRUE(std::isnan(after.bound.at<float>(v, u)));
      } else {
        EXPECT_EQ(after.bound.at<float>(v, u), std::min(bound, first_end));
      }
    }
  }
}

TEST(Edges, OfAStepOnlyTheNearSurfaceAndWhatIsClearOfItKeepTheirDepth) {
  const float near = 4;
  const float far = 8;
  constexpr int kEdge = 40;
  constexpr int kBlur = 5;
  const DepthImage before = measured(step_edge(near, far, kEdge, kBlur));
  DepthImage after = measured(before.depth);
  const EdgeOptions options;
  guard_edges(after, options);
  expect_guarded(before, after, options);
  for (int u = 0; u < before.depth.cols; ++u) {
    const float z = after.depth.at<float>(15, u);
    if (u < kEdge) {
      EXPECT_EQ(z, near) << u;
    } else if (u < kEdge + kBlur) {
      EXPECT_TRUE(std::isnan(z) || z <= near / static_cast<float>(options.nearness)) << u << ' ' << z;
    } else if (u < kEdge + kBlur + 2) {
      EXPECT_TRUE(std::isnan(z)) << "beside what lies clearly before it: " << u;
    } else if (u < kEdge + kBlur + options.radius) {
      EXPECT_TRUE(std::isnan(z) || z == far) << u;
    } else {
      EXPECT_EQ(z, far) << u;
    }
    if (u < kEdge + options.radius) {
      EXPECT_LE(after.bound.at<float>(15, u), 0.9F * near) << u;
    }
  }
}

TEST(Edges, AGroundPlaneAtGrazingAngleLosesLittle) {
  // Camera 1.5 m above the ground, f = 554 px, rows from 20 px below the horizon down.
  cv::Mat depth(220, 60, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) depth.row(v) = 554.26 * 1.5 / (v + 20 + 0.5);
  DepthImage image = measured(depth);
  guard_edges(image, {});
  EXPECT_LT(cv::countNonZero(image.state != kMeasured), 0.02 * static_cast<double>(depth.total()));
}

TEST(Edges, AThinPoleKeepsItsDepthAndHidesWhatIsBesideIt) {
  cv::Mat depth(40, 60, CV_32FC1, cv::Scalar(12));
  depth.colRange(30, 32) = 3;
  DepthImage image = measured(depth);
  const EdgeOptions options;
  guard_edges(image, options);
  expect_guarded(measured(depth), image, options);
  for (int u = 30 - options.radius; u < 32 + options.radius; ++u) {
    const bool pole = u == 30 || u == 31;
    EXPECT_EQ(image.state.at<std::uint8_t>(20, u) == kMeasured, pole) << u;
    EXPECT_LE(image.bound.at<float>(20, u), 2.7F) << "nothing is cleared behind the pole";
  }
  EXPECT_EQ(cv::countNonZero(image.state == kMeasured), 40 * (60 - 2 * options.radius));
}

TEST(Edges, AHoleStaysAHoleAndBoundsBesideAnObstacleEndBeforeIt) {
  cv::Mat depth(24, 40, CV_32FC1, cv::Scalar(9));
  depth.colRange(0, 20) = 5;
  DepthImage before = measured(depth);
  before.state.colRange(22, 40) = static_cast<int>(DepthState::far);
  before.bound.colRange(22, 40) = 25;
  for (cv::Mat* plane : {&before.depth, &before.variance, &before.own_variance})
    plane->colRange(22, 40) = kNan;
  before.bound.at<float>(3, 33) = kNan;
  DepthImage after = before;
  for (cv::Mat* plane : {&after.depth, &after.variance, &after.own_variance, &after.bound, &after.state})
    *plane = plane->clone();
  const EdgeOptions options;
  guard_edges(after, options);
  expect_guarded(before, after, options);
  EXPECT_FLOAT_EQ(after.bound.at<float>(10, 22), 4.5F);
  EXPECT_FLOAT_EQ(after.bound.at<float>(10, 30), 25);
}

TEST(Edges, WithoutARadiusNothingChanges) {
  DepthImage image = measured(step_edge(4, 8, 40, 5));
  EdgeOptions options;
  options.radius = 0;
  guard_edges(image, options);
  EXPECT_EQ(cv::countNonZero(image.state != kMeasured), 0);
  DepthImage empty;
  guard_edges(empty, {});
  EXPECT_TRUE(empty.empty());
}

TEST(Edges, NothingAboutAWrongMatchKeepsABound) {
  constexpr auto kInconsistent = static_cast<std::uint8_t>(DepthState::inconsistent);
  for (const int radius : {1, 3, 5}) {
    DepthImage image = measured(cv::Mat(40, 60, CV_32FC1, cv::Scalar(5)));
    image.state.at<std::uint8_t>(20, 30) = kInconsistent;
    for (cv::Mat* plane : {&image.depth, &image.variance, &image.own_variance})
      plane->at<float>(20, 30) = kNan;
    EdgeOptions options;
    options.radius = radius;
    guard_edges(image, options);
    for (int v = 0; v < 40; ++v) {
      for (int u = 0; u < 60; ++u) {
        const bool about = std::abs(v - 20) <= radius && std::abs(u - 30) <= radius;
        ASSERT_EQ(std::isnan(image.bound.at<float>(v, u)), about) << v << " " << u;
      }
    }
    EXPECT_EQ(cv::countNonZero(image.state == kMeasured), 40 * 60 - 1);
  }
}

}  // namespace
}  // namespace pade::depth
