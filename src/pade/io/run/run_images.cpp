#include "pade/io/run/run_images.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/io/image/image_codec.hpp"

namespace pade::io {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

PngBytes encode_stacked(const cv::Mat& image) {
  return io::encode_png(image, {.level = 1, .runs_only = false, .left_filter = false});
}

/// 0 where there is no positive value, else what `counts` makes of it, up to 65535.
template <class Counts>
PngBytes encode_counts(const cv::Mat& metres, Counts counts) {
  cv::Mat image(metres.size(), CV_16UC1);
  for (int y = 0; y < metres.rows; ++y) {
    const auto* in = metres.ptr<float>(y);
    auto* out = image.ptr<std::uint16_t>(y);
    for (int x = 0; x < metres.cols; ++x) {
      const bool some = in[x] > 0;  // false for NaN
      out[x] = some ? static_cast<std::uint16_t>(std::min(counts(in[x]), 65535.0)) : std::uint16_t{0};
    }
  }
  return encode_stacked(image);
}

}  // namespace

PngBytes encode_metres(const cv::Mat& metres, double scale) {
  return encode_counts(metres, [scale](float value) { return std::max(1.0, std::round(value * scale)); });
}

PngBytes encode_bounds(const cv::Mat& metres, double scale) {
  return encode_counts(metres, [scale](float value) { return std::floor(value * scale); });
}

cv::Mat metres_of(const cv::Mat& counts, double scale) {
  cv::Mat metres(counts.size(), CV_32FC1);
  for (int y = 0; y < counts.rows; ++y) {
    const auto* in = counts.ptr<std::uint16_t>(y);
    auto* out = metres.ptr<float>(y);
    for (int x = 0; x < counts.cols; ++x) out[x] = in[x] > 0 ? static_cast<float>(in[x] / scale) : kNaN;
  }
  return metres;
}

PngBytes encode_image(const cv::Mat& image) { return encode_stacked(image); }

}  // namespace pade::io
