#include "pade/depth/image/outlines.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace pade::depth {
namespace {

constexpr int kDirections = 5;

/// What the rays from the pixels of a row meet first in the three directions to the row before it, and in the
/// direction along it: a bound, 0 = a pixel whose bound is unknown, infinity = the border.
struct Met {
  explicit Met(int width) : straight(size(width), kBorder), left(straight), right(straight) {}
  static std::size_t size(int width) { return static_cast<std::size_t>(width) + 2; }  // one beyond each end
  static constexpr float kBorder = std::numeric_limits<float>::infinity();
  std::vector<float> straight, left, right;
};

/// Half of the directions: rows top down (step 1) or bottom up (-1), along each row in the same sense.
void sweep(const DepthImage& image, const cv::Mat& open, int step, cv::Mat& least, cv::Mat& count) {
  const int width = image.bound.cols;
  const int height = image.bound.rows;
  Met before(width);
  Met here(width);
  for (int i = 0; i < height; ++i) {
    const int v = step > 0 ? i : height - 1 - i;
    const auto* bound = image.bound.ptr<float>(v);
    const auto* is_open = open.ptr<std::uint8_t>(v);
    auto* to = least.ptr<float>(v);
    auto* met_by = count.ptr<std::uint8_t>(v);
    float along = Met::kBorder;
    for (int j = 0; j < width; ++j) {
      const int u = step > 0 ? j : width - 1 - j;
      const auto at = static_cast<std::size_t>(u) + 1;
      if (is_open[u] == 0) {
        const float value = bound[u] > 0 ? bound[u] : 0.0F;
        along = here.straight[at] = here.left[at] = here.right[at] = value;
        continue;
      }
      here.straight[at] = before.straight[at];
      here.left[at] = before.left[at - 1];
      here.right[at] = before.right[at + 1];
      for (const float value : {along, here.straight[at], here.left[at], here.right[at]}) {
        to[u] = std::min(to[u], value);
        met_by[u] = static_cast<std::uint8_t>(met_by[u] + (value < Met::kBorder ? 1 : 0));
      }
    }
    std::swap(before, here);
  }
}

}  // namespace

void bound_by_outlines(DepthImage& image) {
  if (image.bound.empty()) return;
  const cv::Mat open = (image.state == static_cast<std::uint8_t>(DepthState::no_texture)) &
                       ~cv::Mat(image.bound == image.bound);
  cv::Mat least(image.bound.size(), CV_32FC1, cv::Scalar(Met::kBorder));
  cv::Mat count(image.bound.size(), CV_8UC1, cv::Scalar(0));
  sweep(image, open, 1, least, count);
  sweep(image, open, -1, least, count);
  least.copyTo(image.bound, open & (count >= kDirections) & (least > 0));
}

}  // namespace pade::depth
