// A flight along the optical axis whose exact flow and epipolar lines are known in closed form.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/flow/epipolar/epipolar.hpp"

#include "flow/flow_scene.hpp"

namespace pade::flow::testing {

/// A camera that flies along its optical axis toward a slanted plane, the focus of expansion inside the
/// image.
struct ForwardFlight {
  cv::Mat first, second;  ///< CV_8UC1
  cv::Mat truth;          ///< CV_32FC2
  EpipolarField lines;

  /// @param scale  the image has 320 scale x 240 scale pixels, and the motion in pixels grows alike.
  /// @param noise  standard deviation of the images' noise, grey levels.
  explicit ForwardFlight(int scale = 1, double noise = 0) : truth(240 * scale, 320 * scale, CV_32FC2) {
    constexpr double kStep = 0.4;
    constexpr double kDistance = 8;
    const cv::Size size = truth.size();
    const double focal = 250 * scale;
    const cv::Point2d centre(165 * scale, 117 * scale);
    const auto slant = [&](double x, double y) {
      return 0.15 * (x - centre.x) / focal + 0.6 * (y - centre.y) / focal + 1;
    };
    const Waves waves(7);
    first = render(size, waves);
    second = render(size, waves, [&](double x, double y) {
      const double z = (kDistance - kStep) / slant(x, y);
      return centre + (cv::Point2d(x, y) - centre) * (z / (z + kStep));
    });
    cv::RNG random(1);
    for (cv::Mat* image : {&first, &second}) {
      cv::Mat added(size, CV_16SC1);
      random.fill(added, cv::RNG::NORMAL, 0, noise);
      cv::add(*image, added, *image, cv::noArray(), CV_8U);
    }
    lines.direction.create(size, CV_32FC2);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double z = kDistance / slant(x, y);
        const cv::Point2d from(x - centre.x, y - centre.y);
        truth.at<cv::Vec2f>(y, x) = cv::Vec2d(from.x, from.y) * (kStep / (z - kStep));
        lines.direction.at<cv::Vec2f>(y, x) =
            cv::Vec2d(from.x, from.y) * (1 / std::max(cv::norm(from), 1e-9));
      }
    }
  }
};

/// Median end-point error, pixels, over the pixels at least `margin` from the border whose truth is known.
inline double median_error(const cv::Mat& vectors, const cv::Mat& truth, int margin = 8) {
  std::vector<double> errors;
  for (int y = margin; y < truth.rows - margin; ++y) {
    for (int x = margin; x < truth.cols - margin; ++x) {
      const double error = cv::norm(vectors.at<cv::Vec2f>(y, x) - truth.at<cv::Vec2f>(y, x));
      if (error == error) errors.push_back(error);
    }
  }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

}  // namespace pade::flow::testing
