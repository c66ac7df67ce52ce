#include "pade/depth/image/outlines.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

constexpr int kWidth = 90;
constexpr int kHeight = 70;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);
constexpr auto kNoTexture = static_cast<std::uint8_t>(DepthState::no_texture);

/// Bounds 1 / (a + b u + c v), everywhere known.
DepthImage plane(float a, float b, float c) {
  DepthImage image;
  image.depth = cv::Mat(kHeight, kWidth, CV_32FC1, cv::Scalar(kNan));
  image.bound = image.depth.clone();
  image.state = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(kMeasured));
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      image.bound.at<float>(v, u) = 1 / (a + b * static_cast<float>(u) + c * static_cast<float>(v));
    }
  }
  return image;
}

/// Takes texture and bounds from a part of it.
void blank(DepthImage& image, cv::Rect patch) {
  image.bound(patch) = kNan;
  image.state(patch) = kNoTexture;
}

TEST(Outlines, APatchOfAPlaneGetsTheBoundsOfThePlane) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const auto slope = [&] { return static_cast<float>(0.001 * random.uniform()); };
    const DepthImage whole = plane(0.05F, slope(), slope());
    DepthImage image = whole;
    image.bound = whole.bound.clone();
    image.state = whole.state.clone();
    blank(image, {20, 15, 12 + i, 30});
    bound_by_outlines(image);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        ASSERT_NEAR(image.bound.at<float>(v, u), whole.bound.at<float>(v, u),
                    1e-3F * whole.bound.at<float>(v, u));
      }
    }
  }
}

/// What stands in front at one side of a patch does not bring all of it near; a wall all around does.
TEST(Outlines, TheSecondBestLineDecides) {
  DepthImage image = plane(0.1F, 0, 0);  // 10 m
  blank(image, {20, 15, 40, 30});
  image.bound(cv::Rect(60, 15, 6, 30)) = 2.0F;  // a pole at the right
  bound_by_outlines(image);
  EXPECT_NEAR(image.bound.at<float>(30, 25), 10, 1e-3);
  DepthImage near = plane(0.5F, 0, 0);
  blank(near, {20, 15, 40, 30});
  bound_by_outlines(near);
  EXPECT_NEAR(near.bound.at<float>(30, 40), 2, 1e-3);
}

TEST(Outlines, APatchAtTheBorderGetsTheLeastThatItsRaysMeet) {
  DepthImage image = plane(0.1F, 0, 0);
  blank(image, {20, 0, 40, 30});                // sky
  image.bound(cv::Rect(20, 30, 40, 2)) = 6.0F;  // what it stands on
  bound_by_outlines(image);
  // Only the line along the row has two ends; five rays meet something.
  EXPECT_NEAR(image.bound.at<float>(10, 40), 6, 1e-3);
  DepthImage corner = plane(0.1F, 0, 0);
  blank(corner, {0, 0, kWidth, 40});  // three rays meet something
  bound_by_outlines(corner);
  EXPECT_TRUE(std::isnan(corner.bound.at<float>(10, 40)));
}

TEST(Outlines, ARimThatIsUnknownBoundsNothing) {
  DepthImage image = plane(0.1F, 0, 0);
  blank(image, {20, 15, 40, 30});
  for (int i = 0; i < 2; ++i) image.bound(cv::Rect(19 + 41 * i, 14, 1, 32)) = kNan;
  for (int i = 0; i < 2; ++i) image.bound(cv::Rect(19, 14 + 31 * i, 42, 1)) = kNan;
  bound_by_outlines(image);
  for (int v = 15; v < 45; ++v) {
    for (int u = 20; u < 60; ++u) EXPECT_TRUE(std::isnan(image.bound.at<float>(v, u)));
  }
}

TEST(Outlines, ABoundOfItsOwnStaysWhereItIsGreater) {
  DepthImage image = plane(0.1F, 0, 0);
  blank(image, {20, 15, 40, 30});
  image.bound.at<float>(30, 40) = 14;
  image.bound.at<float>(30, 41) = 4;
  bound_by_outlines(image);
  EXPECT_FLOAT_EQ(image.bound.at<float>(30, 40), 14);
  EXPECT_NEAR(image.bound.at<float>(30, 41), 10, 1e-3);
  EXPECT_EQ(image.state.at<std::uint8_t>(30, 40), kNoTexture);
}

TEST(Outlines, WithTextureEverywhereNothingChanges) {
  DepthImage image = plane(0.1F, 0.001F, 0);
  const cv::Mat before = image.bound.clone();
  bound_by_outlines(image);
  EXPECT_EQ(cv::countNonZero(before != image.bound), 0);
}

/// What the ray from an open pixel in a direction meets: inverse bound (infinity = unknown) and steps;
/// negative: the border.
std::pair<float, float> met(const DepthImage& image, int u, int v, int du, int dv) {
  for (int steps = 1;; ++steps) {
    const cv::Point at(u + steps * du, v + steps * dv);
    if (at.x < 0 || at.y < 0 || at.x >= image.bound.cols || at.y >= image.bound.rows) return {-1, steps};
    if (image.state.at<std::uint8_t>(at) == kNoTexture) continue;
    const float bound = image.bound.at<float>(at);
    return {bound > 0 ? 1 / bound : kInfinity, steps};
  }
}

/// The inverse bound of an open pixel by its eight rays; infinity = none.
float by_rays(const DepthImage& image, int u, int v) {
  const cv::Point directions[] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};
  std::vector<float> lines;
  float greatest = 0;
  int rays = 0;
  for (const cv::Point d : directions) {
    const auto [a, a_steps] = met(image, u, v, -d.x, -d.y);
    const auto [b, b_steps] = met(image, u, v, d.x, d.y);
    const bool known = a >= 0 && a < kInfinity && b >= 0 && b < kInfinity;
    lines.push_back(known ? (a * b_steps + b * a_steps) / (a_steps + b_steps) : kInfinity);
    for (const float rho : {a, b}) {
      if (rho < 0) continue;
      ++rays;
      greatest = std::max(greatest, rho);
    }
  }
  std::sort(lines.begin(), lines.end());
  if (lines[1] < kInfinity) return lines[1];
  return rays >= 5 ? greatest : kInfinity;
}

/// To the last bit, whatever the width leaves over of a vector.
TEST(Outlines, EveryPixelHasWhatItsRaysMeet) {
  Random random(11);
  for (const int width : {1, 7, 33, 70}) {
    DepthImage image;
    image.bound = cv::Mat(40, width, CV_32FC1);
    image.state = cv::Mat(40, width, CV_8UC1);
    const double share = random.uniform(0.2, 0.95);
    for (int v = 0; v < image.bound.rows; ++v) {
      for (int u = 0; u < width; ++u) {
        image.state.at<std::uint8_t>(v, u) = random.uniform() < share ? kNoTexture : kMeasured;
        const auto bound = static_cast<float>(random.uniform(0.5, 30));
        image.bound.at<float>(v, u) = random.uniform() < 0.3 ? kNan : bound;
      }
    }
    cv::Mat expected = image.bound.clone();
    for (int v = 0; v < image.bound.rows; ++v) {
      for (int u = 0; u < width; ++u) {
        if (image.state.at<std::uint8_t>(v, u) != kNoTexture) continue;
        const float rho = by_rays(image, u, v);
        auto& bound = expected.at<float>(v, u);
        if (rho < kInfinity && !(bound * rho >= 1)) bound = 1 / rho;
      }
    }
    bound_by_outlines(image);
    for (int v = 0; v < image.bound.rows; ++v) {
      EXPECT_EQ(
          std::memcmp(image.bound.ptr(v), expected.ptr(v), sizeof(float) * static_cast<std::size_t>(width)),
          0);
    }
  }
}

}  // namespace
}  // namespace pade::depth
