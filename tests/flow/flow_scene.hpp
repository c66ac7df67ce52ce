// Images with an exactly known flow: a random sum of waves, moved analytically.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

namespace pade::flow::testing {

/// Grey value at any point, in [0, 255], smooth down to wavelengths of 5 pixels.
class Waves {
 public:
  explicit Waves(unsigned seed = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 40; ++i) {
      const double wavelength = 5 * std::pow(12.0, unit(random));
      const double direction = 2 * std::numbers::pi * unit(random);
      const double k = 2 * std::numbers::pi / wavelength;
      waves_.push_back(
          {k * std::cos(direction), k * std::sin(direction), 2 * std::numbers::pi * unit(random)});
    }
  }
  [[nodiscard]] double operator()(double x, double y) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += std::sin(w.kx * x + w.ky * y + w.phase);
    return std::clamp(127.5 + 18 * sum, 0.0, 255.0);
  }

 private:
  struct Wave {
    double kx, ky, phase;
  };
  std::vector<Wave> waves_;
};

/// The image seen through `where`: grey value at pixel p is waves(where(p)). CV_8UC1.
inline cv::Mat render(
    cv::Size size, const Waves& waves,
    const std::function<cv::Point2d(double, double)>& where = [](double x, double y) {
      return cv::Point2d(x, y);
    }) {
  cv::Mat image(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const cv::Point2d p = where(x, y);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(waves(p.x, p.y));
    }
  }
  return image;
}

/// Two images whose flow is the same everywhere.
struct ShiftedPair {
  cv::Mat first;
  cv::Mat second;
};
inline ShiftedPair shifted_pair(cv::Size size, cv::Point2d shift, unsigned seed = 1) {
  const Waves waves(seed);
  return {render(size, waves),
          render(size, waves, [&](double x, double y) { return cv::Point2d(x, y) - shift; })};
}

/// Black, white, noise, a checkerboard and one straight edge: images that say nothing, too much, or half of
/// it.
inline std::vector<cv::Mat> difficult_images(cv::Size size) {
  cv::Mat noise(size, CV_8UC1);
  cv::randu(noise, 0, 256);
  cv::Mat checkerboard(size, CV_8UC1);
  cv::Mat edge(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      checkerboard.at<std::uint8_t>(y, x) = (x + y) % 2 == 0 ? 0 : 255;
      edge.at<std::uint8_t>(y, x) = x + y > size.height ? 255 : 0;
    }
  }
  return {cv::Mat(size, CV_8UC1, cv::Scalar(0)), cv::Mat(size, CV_8UC1, cv::Scalar(255)), noise, checkerboard,
          edge};
}

}  // namespace pade::flow::testing
