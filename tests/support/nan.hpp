// How many values of an image are NaN.
#pragma once

#include <opencv2/core.hpp>

namespace pade::test {

/// Of all channels. Not through OpenCV's !=, which takes NaN for equal in its vector lanes.
inline int count_nan(const cv::Mat& image) {
  cv::Mat number;
  cv::compare(image, image, number, cv::CMP_EQ);
  return static_cast<int>(number.total()) * number.channels() - cv::countNonZero(number.reshape(1));
}

}  // namespace pade::test
