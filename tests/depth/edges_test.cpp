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

/// A wall at Z = 10 m straight ahead, nothing measured: bounds as parallax of `sigma` px per metre of motion
/// gives them around the epipole in the middle.
struct BlindSpot {
  BlindSpot() {
    camera.width = 161;
    camera.height = 121;
    camera.fx = camera.fy = 500;
    camera.cx = 80;
    camera.cy = 60;
    motion.t_reference_other = {0, 0, -0.8};
    const cv::Size size(161, 121);
    image.depth = cv::Mat(size, CV_32FC1, cv::Scalar(kNan));
    image.variance = image.depth.clone();
    image.own_variance = image.depth.clone();
    image.state = cv::Mat(size, CV_8UC1, cv::Scalar(static_cast<int>(DepthState::low_parallax)));
    image.bound = image.depth.clone();
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
        const double reach = 0.8 * std::hypot(u - 80, v - 60);
        const auto bound = static_cast<float>(reach / (reach / 10.8 + 1) - 0.8);
        if (bound > 0) image.bound.at<float>(v, u) = bound;
      }
    }
  }
  Camera camera;
  RelativeMotion motion;
  DepthImage image;
};

bool unchanged(const cv::Mat& a, const cv::Mat& b) {
  const cv::Mat both_nan = ~cv::Mat(a == a) & ~cv::Mat(b == b);
  return cv::countNonZero((a == b) | both_nan) == static_cast<int>(a.total());
}

TEST(Epipole, IsClosedUpToWhereItHidesNoMoreThanTheHole) {
  for (const double hole : {0.03, 0.05, 0.1}) {
    BlindSpot spot;
    const cv::Mat before = spot.image.bound.clone();
    close_epipole(spot.image, spot.camera, spot.motion, hole);
    const float closed = spot.image.bound.at<float>(60, 80);
    ASSERT_GT(closed, 1) << hole;
    EXPECT_LT(closed, 10) << hole;
    for (int v = 0; v < before.rows; ++v) {
      for (int u = 0; u < before.cols; ++u) {
        const float was = before.at<float>(v, u);
        const float is = spot.image.bound.at<float>(v, u);
        const bool raised = std::isnan(was) ? !std::isnan(is) : is > was;
        if (raised) {
          EXPECT_EQ(is, closed);  // and a thing there, at that depth, is no larger than the hole
          EXPECT_LE(2 * std::hypot(u - 80, v - 60) * is / 500, hole + 1e-6);
        } else {
          EXPECT_TRUE(is == was || (std::isnan(is) && std::isnan(was)));
        }
      }
    }
  }
}

TEST(Epipole, KeepsWhatIsMeasuredWithoutTextureOrBesideANearThing) {
  BlindSpot spot;
  spot.image.state.at<std::uint8_t>(60, 80) = static_cast<std::uint8_t>(DepthState::no_texture);
  spot.image.state.at<std::uint8_t>(60, 81) = kMeasured;
  spot.image.bound.at<float>(60, 81) = 0.4F;
  close_epipole(spot.image, spot.camera, spot.motion, 0.05);
  EXPECT_TRUE(std::isnan(spot.image.bound.at<float>(60, 80)));
  EXPECT_EQ(spot.image.bound.at<float>(60, 81), 0.4F);

  BlindSpot beside;  // a near thing all around it: no ring is bounded far enough
  beside.image.bound.colRange(0, 76).setTo(0.5F);
  const cv::Mat before = beside.image.bound.clone();
  close_epipole(beside.image, beside.camera, beside.motion, 0.05);
  EXPECT_TRUE(unchanged(before, beside.image.bound));
}

TEST(Epipole, IsLeftAloneWithoutAHoleOrForwardMotion) {
  BlindSpot spot;
  const cv::Mat before = spot.image.bound.clone();
  close_epipole(spot.image, spot.camera, spot.motion, 0);
  EXPECT_TRUE(unchanged(before, spot.image.bound));
  spot.motion.t_reference_other = {0.8, 0, 0.01};
  close_epipole(spot.image, spot.camera, spot.motion, 0.05);
  EXPECT_TRUE(unchanged(before, spot.image.bound));
}

}  // namespace
}  // namespace pade::depth
