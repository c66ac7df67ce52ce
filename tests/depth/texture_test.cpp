#include "pade/depth/texture.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "pade/core/depth_image.hpp"
#include "pade/core/random.hpp"

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
const Camera kCamera{kSize.width, kSize.height, 150, 150, 80, 41};

RelativeMotion moving(const Eigen::Vector3d& t) {
  RelativeMotion motion;
  motion.t_reference_other = t;
  return motion;
}

const FlowField kStill{cv::Mat::zeros(kSize, CV_32FC2), {}};
constexpr TextureLimits kLimits{3, 0.5};

int blank_pixels(const cv::Mat& first, const cv::Mat& second, const Eigen::Vector3d& t) {
  const double noise = image_noise(first, second, kStill);
  const cv::Mat gate = texture_gate(first, second, kStill, kCamera, moving(t), kLimits, noise);
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

TEST(ImageNoise, IsNotChangedByExposureOrByTextureThatTheFlowMatches) {
  const cv::Mat texture = grating(kSize, 0.2, 0.13);
  const cv::Mat first = noisy(texture, 2, 1);
  const cv::Mat second = noisy(texture, 2, 2) + 9;
  EXPECT_NEAR(image_noise(first, second, kStill), 2, 0.5);
}

TEST(ImageNoise, OfFlowThatMatchesNothingIsTheLeastNoise) {
  const FlowField away{cv::Mat(kSize, CV_32FC2, cv::Scalar(1e6, 0)), {}};
  const cv::Mat image = grating(kSize, 0.2, 0.13);
  EXPECT_NEAR(image_noise(image, image, away), 0.5, 1e-9);
}

}  // namespace
}  // namespace pade::depth
