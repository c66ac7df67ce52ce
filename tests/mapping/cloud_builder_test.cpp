#include "pade/mapping/cloud_builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace pade::mapping {
namespace {

const Camera kCloudCamera{.width = 64, .height = 48, .fx = 50, .fy = 50, .cx = 31.5, .cy = 23.5};

/// A rough wall about 4 m away; sigma differs from pixel to pixel and image to image.
DepthImage rough_wall(std::uint64_t seed) {
  cv::RNG random(seed);
  DepthImage image;
  image.depth.create(kCloudCamera.size(), CV_32FC1);
  random.fill(image.depth, cv::RNG::UNIFORM, 3.8, 4.2);
  cv::Mat sigma(kCloudCamera.size(), CV_32FC1);
  random.fill(sigma, cv::RNG::UNIFORM, 0.01, 0.6);
  image.variance = sigma.mul(sigma);
  return image;
}

std::array<int, 3> cube_of_point(const CloudPoint& point, double spacing) {
  const auto cell = [&](float value) {
    return static_cast<int>(std::floor(static_cast<double>(value) / spacing));
  };
  return {cell(point.x), cell(point.y), cell(point.z)};
}

TEST(CloudBuilder, KeepsOfEachCubeThePointWithTheLeastSigma) {
  CloudOptions fine;  // every point in a cube of its own
  fine.spacing = 0.001;
  fine.step = 1;
  CloudOptions coarse = fine;
  coarse.spacing = 0.25;
  const cv::Mat grey(kCloudCamera.size(), CV_8UC1, cv::Scalar(100));
  CloudBuilder thinned(coarse);
  std::map<std::array<int, 3>, float> least;
  for (const std::uint64_t seed : {1, 2, 3}) {
    thinned.add(rough_wall(seed), kCloudCamera, Pose{}, grey);
    CloudBuilder all(fine);
    all.add(rough_wall(seed), kCloudCamera, Pose{}, grey);
    for (const CloudPoint& point : all.cloud()) {
      const auto [entry, is_new] = least.try_emplace(cube_of_point(point, coarse.spacing), point.sigma);
      if (!is_new) entry->second = std::min(entry->second, point.sigma);
    }
  }
  ASSERT_EQ(thinned.cloud().size(), least.size());
  ASSERT_GT(least.size(), 100U);
  for (const CloudPoint& point : thinned.cloud())
    EXPECT_EQ(point.sigma, least.at(cube_of_point(point, coarse.spacing)));
}

TEST(CloudBuilder, LeavesOutWhatIsLessCertainThanAShareOfItsDepthAlongTheAxis) {
  CloudOptions options;
  options.spacing = 0.001;
  options.step = 1;
  const DepthImage image = rough_wall(4);
  const Pose looking_back{Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d(1, 2, 3).normalized())),
                          {5, -3, 2}};
  CloudBuilder builder(options);
  builder.add(image, kCloudCamera, looking_back, {});
  std::size_t certain = 0;
  for (int v = 0; v < image.depth.rows; ++v) {
    for (int u = 0; u < image.depth.cols; ++u) {
      const double sigma = std::sqrt(static_cast<double>(image.variance.at<float>(v, u)));
      if (sigma < options.largest_relative_sigma * static_cast<double>(image.depth.at<float>(v, u)))
        ++certain;
    }
  }
  EXPECT_GT(certain, image.depth.total() / 3);
  EXPECT_LT(certain, image.depth.total());
  EXPECT_NEAR(static_cast<double>(builder.cloud().size()), static_cast<double>(certain), 3);
}

}  // namespace
}  // namespace pade::mapping
