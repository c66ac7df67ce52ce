#include "pade/io/sequence/intensity.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>

namespace pade::io {
namespace {

/// The smallest value that at least `share` of the counted values do not exceed.
double percentile(const std::vector<std::size_t>& histogram, std::size_t total, double share) {
  const double wanted = share * static_cast<double>(total);
  double seen = 0;
  for (std::size_t value = 0; value < histogram.size(); ++value) {
    seen += static_cast<double>(histogram[value]);
    if (seen > 0 && seen >= wanted) return static_cast<double>(value);
  }
  return static_cast<double>(histogram.size() - 1);
}

}  // namespace

cv::Mat IntensityScaling::operator()(const cv::Mat& image) const {
  if (image.depth() == CV_8U) return image;
  cv::Mat table(1, 65536, CV_8UC1);
  auto* const entries = table.ptr<std::uint8_t>();
  entries[0] = 0;
  for (int v = 1; v < table.cols; ++v) {
    const double scaled = std::round(255 * (v - low) / (high - low));
    entries[v] = static_cast<std::uint8_t>(std::clamp(scaled, 1.0, 255.0));
  }
  cv::Mat out(image.size(), CV_MAKETYPE(CV_8U, image.channels()));
  const int count = image.cols * image.channels();
  for (int row = 0; row < image.rows; ++row) {
    const auto* const from = image.ptr<std::uint16_t>(row);
    auto* const to = out.ptr<std::uint8_t>(row);
    for (int i = 0; i < count; ++i) to[i] = entries[from[i]];
  }
  return out;
}

IntensityScaling intensity_from_percentiles(const std::vector<cv::Mat>& samples) {
  std::vector<std::size_t> histogram(65536, 0);
  std::size_t total = 0;
  for (const cv::Mat& image : samples) {
    const int count = image.cols * image.channels();
    for (int row = 0; row < image.rows; ++row) {
      const auto* const values = image.ptr<std::uint16_t>(row);
      for (int i = 0; i < count; ++i) ++histogram[values[i]];
    }
    total += image.total() * static_cast<std::size_t>(image.channels());
  }
  total -= histogram[0];
  histogram[0] = 0;
  IntensityScaling scaling;
  scaling.bits = 16;
  scaling.source = fmt::format("0.1 and 99.9 percentile of {} frames, widened by a tenth", samples.size());
  const double low = percentile(histogram, total, 0.001);
  const double high = percentile(histogram, total, 0.999);
  const double margin = 0.1 * std::max(high - low, 1.0);
  scaling.low = std::max(low - margin, 0.0);
  scaling.high = std::min(high + margin, 65535.0);
  return scaling;
}

}  // namespace pade::io
