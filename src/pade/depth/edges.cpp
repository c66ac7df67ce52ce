#include "pade/depth/edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace pade::depth {

void guard_edges(DepthImage& image, const EdgeOptions& options) {
  if (options.radius < 1 || image.empty()) return;
  constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);
  const float infinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat square =
      cv::getStructuringElement(cv::MORPH_RECT, {2 * options.radius + 1, 2 * options.radius + 1});
  // About a wrong match others are wrong that look right.
  cv::Mat doubtful = image.state == static_cast<std::uint8_t>(DepthState::inconsistent);
  cv::dilate(doubtful, doubtful, square);
  image.bound.setTo(nan, doubtful);
  const auto nearest_of = [&](const cv::Mat& values) {
    cv::Mat nearest(values.size(), CV_32FC1);
    for (int v = 0; v < values.rows; ++v) {
      const auto* value = values.ptr<float>(v);
      const auto* state = image.state.ptr<std::uint8_t>(v);
      auto* out = nearest.ptr<float>(v);
      for (int u = 0; u < values.cols; ++u) {
        out[u] = (state[u] == kMeasured) & (value[u] == value[u]) ? value[u] : infinity;
      }
    }
    cv::erode(nearest, nearest, square, {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(infinity));
    return nearest;
  };
  const cv::Mat nearest = nearest_of(image.depth);
  const cv::Mat first_end = nearest_of(image.bound);
  const auto nearness = static_cast<float>(options.nearness);
  for (int v = 0; v < image.depth.rows; ++v) {
    auto* depth = image.depth.ptr<float>(v);
    auto* variance = image.variance.ptr<float>(v);
    auto* own = image.own_variance.ptr<float>(v);
    auto* bound = image.bound.ptr<float>(v);
    auto* state = image.state.ptr<std::uint8_t>(v);
    const auto* near = nearest.ptr<float>(v);
    const auto* end = first_end.ptr<float>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      if (bound[u] > end[u]) bound[u] = end[u];
      if (state[u] != kMeasured || near[u] >= nearness * depth[u]) continue;
      state[u] = static_cast<std::uint8_t>(DepthState::inconsistent);
      depth[u] = variance[u] = own[u] = nan;
    }
  }
}

}  // namespace pade::depth
