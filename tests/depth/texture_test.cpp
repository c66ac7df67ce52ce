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

TEST(StructureTensor, OfAGratingIsItsMeanSquaredGradient) {
  const StructureTensor tensor = structure_tensor(grating(kSize, 0.3, 0));
  EXPECT_EQ(tensor.xx.size(), cv::Size(41, 21));
  EXPECT_NEAR(cv::mean(tensor.xx)[0], 0.5 * std::pow(40 * std::sin(0.3), 2), 6);
  EXPECT_LT(cv::mean(tensor.yy)[0], 0.5);
}

TEST(TextureGate, AGratingAlongTheMotionSaysNothingAboutIt) {
  const cv::Mat vertical_stripes = grating(kSize, 0.3, 0);
  const StructureTensor tensor = structure_tensor(vertical_stripes);
  const cv::Mat sideways = texture_gate(tensor, kCamera, moving({0.1, 0, 0}), 3, 1, kSize);
  const cv::Mat vertical = texture_gate(tensor, kCamera, moving({0, 0.1, 0}), 3, 1, kSize);
  EXPECT_EQ(cv::countNonZero(sideways), 0);
  EXPECT_EQ(cv::countNonZero(vertical == static_cast<int>(DepthState::no_texture)), kSize.area());
}

TEST(TextureGate, PureNoiseIsNoTextureWhateverItsStrength) {
  const cv::Mat blank(kSize, CV_8UC1, cv::Scalar(120));
  for (const double sigma : {0.0, 1.0, 4.0, 10.0}) {
    const cv::Mat first = noisy(blank, sigma, 1);
    const cv::Mat second = noisy(blank, sigma, 2);
    const FlowField still{cv::Mat::zeros(kSize, CV_32FC2), {}};
    const double noise = image_noise(first, second, still);
    EXPECT_NEAR(noise, std::max(0.29, sigma), 0.25 * sigma + 0.1);
    const cv::Mat gate = texture_gate(structure_tensor(first), kCamera, moving({0.1, 0, 0}), 3, noise, kSize);
    EXPECT_EQ(cv::countNonZero(gate), kSize.area()) << sigma;
  }
}

TEST(ImageNoise, IsNotChangedByExposureOrByTextureThatTheFlowMatches) {
  const cv::Mat texture = grating(kSize, 0.2, 0.13);
  const cv::Mat first = noisy(texture, 2, 1);
  const cv::Mat second = noisy(texture, 2, 2) + 9;
  const FlowField still{cv::Mat::zeros(kSize, CV_32FC2), {}};
  EXPECT_NEAR(image_noise(first, second, still), 2, 0.5);
}

TEST(ImageNoise, OfFlowThatMatchesNothingIsTheRoundingNoise) {
  const FlowField away{cv::Mat(kSize, CV_32FC2, cv::Scalar(1e6, 0)), {}};
  const cv::Mat image = grating(kSize, 0.2, 0.13);
  EXPECT_NEAR(image_noise(image, image, away), 0.2887, 1e-3);
}

}  // namespace
}  // namespace pade::depth
