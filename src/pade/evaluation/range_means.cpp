#include "pade/evaluation/range_means.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pade::evaluation {
namespace {

double ratio(double part, std::uint64_t whole) {
  return whole > 0 ? part / static_cast<double>(whole) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void RangeMeans::add(const DepthImage& estimate, const cv::Mat& true_depth, double max_depth, int grid,
                     const DepthImage* where) {
  const auto limit = static_cast<float>(max_depth);
  const auto answers = [limit](const DepthImage& image, int y, int x) {
    const float depth = image.depth.at<float>(y / image.window, x / image.window);
    return depth > 0 && depth <= limit;
  };
  for (int y = grid / 2; y < true_depth.rows; y += grid) {
    const auto* const row = true_depth.ptr<float>(y);
    for (int x = grid / 2; x < true_depth.cols; x += grid) {
      if (!is_truth(row[x])) continue;
      const std::size_t range = range_of(row[x]);
      ++truth[range];
      if (!answers(estimate, y, x) || (where != nullptr && !answers(*where, y, x))) continue;
      ++pixels[range];
      error[range] += std::abs(estimate.depth.at<float>(y / estimate.window, x / estimate.window) - row[x]);
    }
  }
}

double RangeMeans::mean(std::size_t range) const { return ratio(error[range], pixels[range]); }
double RangeMeans::coverage(std::size_t range) const {
  return ratio(static_cast<double>(pixels[range]), truth[range]);
}

}  // namespace pade::evaluation
