#include "pade/core/depth_image.hpp"

#include <opencv2/imgproc.hpp>

namespace pade {

DepthImage at_full_size(const DepthImage& image, cv::Size size) {
  if (image.window == 1) return image;
  const auto grow = [&](const cv::Mat& cells) {
    cv::Mat pixels;
    if (cells.empty()) return pixels;
    cv::resize(cells, pixels, {}, image.window, image.window, cv::INTER_NEAREST);
    return cv::Mat(pixels, cv::Rect({0, 0}, size)).clone();
  };
  return {image.time,        1,
          grow(image.depth), grow(image.variance),
          grow(image.state), grow(image.own_variance),
          grow(image.bound)};
}

}  // namespace pade
