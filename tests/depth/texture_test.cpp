#include "pade/depth/texture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "pade/core/depth_image.hpp"
#include "pade/core/random.hpp"

#include "support/guarded_image.hpp"

namespace pade::depth {
namespace {

cv::Mat noisy(const cv::Mat& clean, double sigma, std::uint64_t seed) {
  Random random(seed);
  cv::Mat out = clean.clone();
  for (auto& value : cv::Mat_<std::uint8_t>(out))
    value = cv::saturate_cast<std::uint8_t>(value + sigma * random.normal());
  return out;
}

cv::Mat grating(cv::Size size, double kx, double ky) {
  cv::Mat image(size, CV_8UC1);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(128 + 40 * std::sin(kx * u + ky * v));
    }
  }
  return image;
}

const cv::Size kSize(161, 83);  // not a multiple of the block
const Camera kTextureCamera{kSize.width, kSize.height, 150, 150, 80, 41};

RelativeMotion moving(const Eigen::Vector3d& t) {
  RelativeMotion motion;
  motion.t_reference_other = t;
  return motion;
}

const FlowField kStill{cv::Mat::zeros(kSize, CV_32FC2), {}};
constexpr TextureLimits kLimits{3, 0.5};

int blank_pixels(const cv::Mat& first, const cv::Mat& second, const Eigen::Vector3d& t) {
  const double noise = image_noise(first, second, kStill);
  const cv::Mat gate = texture_gate(first, second, kStill, kTextureCamera, moving(t), kLimits, noise);
  return cv::countNonZero(gate == static_cast<int>(DepthState::no_texture));
}

TEST(TextureGate, AGratingAlongTheMotionSaysNothingAboutIt) {
  const cv::Mat stripes = grating(kSize, 0.3, 0);
  EXPECT_EQ(blank_pixels(stripes, stripes, {0.1, 0, 0}), 0);
  EXPECT_EQ(blank_pixels(stripes, stripes, {0, 0.1, 0}), kSize.area());
}

TEST(TextureGate, PureNoiseIsNoTextureWhateverItsStrength) {
  const cv::Mat blank(kSize, CV_8UC1, cv::Scalar(120));
  for (const double sigma : {0.0, 1.0, 4.0, 10.0}) {
    const cv::Mat first = noisy(blank, sigma, 1);
    const cv::Mat second = noisy(blank, sigma, 2);
    EXPECT_NEAR(image_noise(first, second, kStill), std::max(0.5, sigma), 0.25 * sigma + 0.1);
    EXPECT_EQ(blank_pixels(first, second, {0.1, 0, 0}), kSize.area()) << sigma;
  }
}

TEST(TextureGate, ShadingIsNoTextureButFaintTextureThatBothImagesShowIs) {
  cv::Mat shading(kSize, CV_8UC1);
  for (int v = 0; v < kSize.height; ++v) {
    for (int u = 0; u < kSize.width; ++u)
      shading.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(60 + 0.2 * u);
  }
  EXPECT_GT(blank_pixels(noisy(shading, 1, 1), noisy(shading, 1, 2), {0.1, 0, 0}), 0.95 * kSize.area());
  cv::Mat faint;
  grating(kSize, 0.8, 0.3).convertTo(faint, CV_8U, 0.1, 100);  // amplitude 4 in noise of 2
  EXPECT_LT(blank_pixels(noisy(faint, 2, 1), noisy(faint, 2, 2), {0.1, 0, 0}), 0.05 * kSize.area());
}

cv::Mat gate_of(const cv::Mat& first, const cv::Mat& second, const RelativeMotion& motion) {
  return texture_gate(first, second, kStill, kTextureCamera, motion, kLimits,
                      image_noise(first, second, kStill));
}

TEST(TextureGate, AtTheEpipoleTextureMustRunInEveryDirection) {
  const RelativeMotion forward = moving({0, 0, 0.2});  // the epipole is the principal point, (80, 41)
  const cv::Rect epipole(76, 37, 8, 8);
  const auto blank = [&](const cv::Mat& gate, cv::Rect part) { return cv::countNonZero(gate(part)); };
  for (const double angle : {0.0, 0.4, 1.1, 1.57}) {
    const cv::Mat stripes = grating(kSize, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
    EXPECT_EQ(blank(gate_of(noisy(stripes, 1, 1), noisy(stripes, 1, 2), forward), epipole), epipole.area())
        << angle;
  }
  const cv::Mat stripes = grating(kSize, 0.5, 0);
  const cv::Mat gate = gate_of(stripes, stripes, forward);
  EXPECT_EQ(blank(gate, {120, 37, 40, 8}), 0) << "stripes across the line, away from the epipole";

  cv::Mat crossed;
  cv::addWeighted(stripes, 0.5, grating(kSize, 0.1, 0.5), 0.5, 0, crossed);
  EXPECT_EQ(blank(gate_of(noisy(crossed, 1, 1), noisy(crossed, 1, 2), forward), epipole), 0);
  cv::Mat faint;
  crossed.convertTo(faint, CV_8U, 0.22, 100);  // in noise of 2: seen only in that both images show it
  EXPECT_EQ(blank(gate_of(noisy(faint, 2, 1), noisy(faint, 2, 2), forward), epipole), 0);
  const cv::Mat flat(kSize, CV_8UC1, cv::Scalar(120));
  EXPECT_EQ(blank(gate_of(noisy(flat, 2, 1), noisy(flat, 2, 2), forward), epipole), epipole.area());
}

TEST(TextureGate, WhereTheEpipoleIsNotKnownTextureMustRunInEveryDirection) {
  RelativeMotion motion = moving({0, 0, 0.2});
  motion.covariance.topLeftCorner<3, 3>() = std::pow(0.02, 2) * Eigen::Matrix3d::Identity();
  const cv::Mat stripes = grating(kSize, 0.5, 0);
  const cv::Rect beside(100, 37, 12, 8);  // 20 to 32 px from the epipole, which is known to 15 px
  EXPECT_EQ(cv::countNonZero(gate_of(stripes, stripes, motion)(beside)), beside.area());
  EXPECT_EQ(cv::countNonZero(gate_of(stripes, stripes, moving({0, 0, 0.2}))(beside)), 0);
}

/// Blocks of `gate` without texture within `radius` blocks of the one at (c, r), and beyond.
std::pair<int, int> blank_blocks(const cv::Mat& gate, int c, int r, int radius) {
  std::pair<int, int> count;
  for (int y = 0; y < gate.rows / kTextureBlock; ++y) {
    for (int x = 0; x < gate.cols / kTextureBlock; ++x) {
      const bool near = std::max(std::abs(x - c), std::abs(y - r)) <= radius;
      if (gate.at<std::uint8_t>(y * kTextureBlock, x * kTextureBlock) != 0)
        ++(near ? count.first : count.second);
    }
  }
  return count;
}

TEST(TextureGate, WhatABlockShowsCountsForItsNeighboursAndNoFarther) {
  const int c = 20, r = 10;
  const cv::Rect block(c * kTextureBlock, r * kTextureBlock, kTextureBlock, kTextureBlock);
  const cv::Mat flat(kSize, CV_8UC1, cv::Scalar(120));
  const int beyond = (kSize.width / kTextureBlock) * (kSize.height / kTextureBlock) - 25;
  // Strong texture in one of the images is enough by its strength; faint texture must be in both.
  for (const double amplitude : {60.0, 7.5}) {
    cv::Mat waves;
    grating(kSize, 1.2, 0).convertTo(waves, CV_8U, amplitude / 40, 120 - 128 * amplitude / 40);
    cv::Mat textured = flat.clone();
    waves(block).copyTo(textured(block));
    const bool strong = amplitude > 40;
    const cv::Mat gate =
        gate_of(noisy(textured, 2, 1), noisy(strong ? flat : textured, 2, 2), moving({0.1, 0, 0}));
    EXPECT_EQ(blank_blocks(gate, c, r, 1).first, 0) << amplitude;
    EXPECT_GT(blank_blocks(gate, c, r, 2).second, 0.97 * beyond) << amplitude;
  }
}

TEST(ImageNoise, IsReadWhereTheImageIsFlatInBothDirections) {
  // Three quarters of the image have their edges right below the rows that are looked at, and flow that is
  // wrong by a third of a pixel there.
  cv::Mat clean(kSize, CV_8UC1, cv::Scalar(128));
  for (int v = 0; v < kSize.height; ++v) clean.row(v).colRange(0, 120) = (v + 2) / 4 % 2 != 0 ? 60 : 200;
  cv::Mat first = clean.clone();
  cv::Mat second = clean.clone();
  noisy(clean, 2, 1).colRange(120, kSize.width).copyTo(first.colRange(120, kSize.width));
  noisy(clean, 2, 2).colRange(120, kSize.width).copyTo(second.colRange(120, kSize.width));
  const FlowField wrong{cv::Mat(kSize, CV_32FC2, cv::Scalar(0, 0.33)), {}};
  EXPECT_LT(image_noise(first, second, wrong), 4);
}

TEST(ImageNoise, IsNotChangedByExposureOrByTextureThatTheFlowMatches) {
  const cv::Mat texture = grating(kSize, 0.2, 0.13);
  const cv::Mat first = noisy(texture, 2, 1);
  const cv::Mat second = noisy(texture, 2, 2) + 9;
  EXPECT_NEAR(image_noise(first, second, kStill), 2, 0.5);
}

TEST(ImageNoise, ReadsNothingBehindTheImages) {
  const cv::Size size(35, 27);  // rows and columns that are looked at reach the last but one
  const cv::Mat image = noisy(cv::Mat(size, CV_8UC1, cv::Scalar(120)), 3, 1);
  const test::GuardedImage first(image);
  const test::GuardedImage second(image);
  for (const cv::Vec2f& to : {cv::Vec2f(0, 0), cv::Vec2f(1, 0), cv::Vec2f(0, 1), cv::Vec2f(1, 1)}) {
    const FlowField flow{cv::Mat(size, CV_32FC2, cv::Scalar(to[0], to[1])), {}};
    EXPECT_GT(image_noise(first.get(), second.get(), flow), 0) << to;
  }
}

TEST(ImageNoise, OfFlowThatMatchesNothingIsTheLeastNoise) {
  const FlowField away{cv::Mat(kSize, CV_32FC2, cv::Scalar(1e6, 0)), {}};
  const cv::Mat image = grating(kSize, 0.2, 0.13);
  EXPECT_NEAR(image_noise(image, image, away), 0.5, 1e-9);
}

}  // namespace
}  // namespace pade::depth
