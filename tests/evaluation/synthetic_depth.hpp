// Depth images with a known truth, for tests of what comes after the depth room.
#pragma once

#include <cmath>
#include <limits>
#include <random>

#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"

namespace pade::test {

/// True depth from 1 m at the top to 21 m at the bottom; a few pixels without truth.
inline cv::Mat truth_ramp(cv::Size size) {
  cv::Mat truth(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto depth = static_cast<float>(1 + 20.0 * (y * size.width + x) / size.area());
      truth.at<float>(y, x) = (x * 7 + y) % 31 == 0 ? std::numeric_limits<float>::quiet_NaN() : depth;
    }
  }
  return truth;
}

/// The truth (1 m where there is none) with normal noise of sigma = `noise` * Z, which the variance states;
/// every tenth cell has no depth. With window n a cell takes the truth of its first pixel.
inline DepthImage noisy_estimate(const cv::Mat& truth, double noise, unsigned seed, int window = 1) {
  const cv::Size cells((truth.cols + window - 1) / window, (truth.rows + window - 1) / window);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  DepthImage image{Time::from_seconds(seed), window, cv::Mat(cells, CV_32FC1, cv::Scalar(kNaN)),
                   cv::Mat(cells, CV_32FC1, cv::Scalar(kNaN)), cv::Mat(cells, CV_8UC1, cv::Scalar(3))};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < cells.height; ++y) {
    for (int x = 0; x < cells.width; ++x) {
      const double error = normal(random);
      if ((x + 3 * y) % 10 == 0) continue;
      const float true_depth = truth.at<float>(y * window, x * window);
      const double depth = std::isnan(true_depth) ? 1.0 : true_depth;
      const double sigma = noise * depth;
      image.depth.at<float>(y, x) = static_cast<float>(depth + sigma * error);
      image.variance.at<float>(y, x) = static_cast<float>(sigma * sigma);
      image.state.at<std::uint8_t>(y, x) = 0;
    }
  }
  return image;
}

}  // namespace pade::test
