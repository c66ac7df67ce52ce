#include "pade/depth/multi_view/exposure.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace pade::depth {
namespace {

constexpr double kPoints = 1200;  // about as many are asked
constexpr std::size_t kFewest = 100;
constexpr int kDarkest = 2;  // grey values beyond which a pixel may be clipped
constexpr int kBrightest = 253;
constexpr double kDiffer = 1;  // grey values, root mean square
constexpr double kLeastRelated = 0.5;
constexpr double kLeastGain = 0.2;

struct Pair {
  double here, there;
};

/// Grey values of the same points in both images.
std::vector<Pair> pairs(const cv::Mat& reference, const cv::Mat& view, const cv::Mat& d, const cv::Matx33f& H,
                        const cv::Vec3f& e, const cv::Mat& valid) {
  const auto clear = [](int grey) { return grey >= kDarkest && grey <= kBrightest; };
  const int step = std::max(2, static_cast<int>(std::sqrt(static_cast<double>(reference.total()) / kPoints)));
  std::vector<Pair> found;
  for (int v = step / 2; v < reference.rows; v += step) {
    for (int u = step / 2; u < reference.cols; u += step) {
      const int here = reference.at<std::uint8_t>(v, u);
      if (!clear(here) || (!valid.empty() && valid.at<std::uint8_t>(v, u) == 0)) continue;
      const cv::Vec3f p =
          H * cv::Vec3f(static_cast<float>(u), static_cast<float>(v), 1) + d.at<float>(v, u) * e;
      if (!(p[2] > 0)) continue;
      const float x = p[0] / p[2];
      const float y = p[1] / p[2];
      if (!(x >= 0 && y >= 0 && x <= static_cast<float>(view.cols - 1) &&
            y <= static_cast<float>(view.rows - 1)))
        continue;
      const auto cx = static_cast<int>(std::lround(x));
      const auto cy = static_cast<int>(std::lround(y));
      const int there = view.at<std::uint8_t>(cy, cx);
      if (!clear(there) || (!valid.empty() && valid.at<std::uint8_t>(cy, cx) == 0)) continue;
      found.push_back({static_cast<double>(here), static_cast<double>(there)});
    }
  }
  return found;
}

/// here = gain * there + offset. Both have the noise of a match that is not exact, so that a regression on
/// either of them would flatten the line: the gain is the ratio of their deviations.
struct Line {
  double gain = 1, offset = 0;
  std::size_t used = 0;
  bool related = false;
};
Line line_of(const std::vector<Pair>& pairs, const Line& about, double limit) {
  Line line;
  double x = 0;
  double y = 0;
  double xx = 0;
  double yy = 0;
  double xy = 0;
  for (const Pair& p : pairs) {
    if (!(std::abs(p.here - about.gain * p.there - about.offset) < limit)) continue;
    ++line.used;
    x += p.there;
    y += p.here;
    xx += p.there * p.there;
    yy += p.here * p.here;
    xy += p.there * p.here;
  }
  if (line.used < kFewest) return line;
  const auto n = static_cast<double>(line.used);
  const double var_x = xx / n - x / n * (x / n);
  const double var_y = yy / n - y / n * (y / n);
  const double both = xy / n - x / n * (y / n);
  line.related = var_x > 1 && var_y > 1 && both > kLeastRelated * std::sqrt(var_x * var_y);
  if (!line.related) return line;
  line.gain = std::sqrt(var_y / var_x);
  line.offset = y / n - line.gain * x / n;
  return line;
}

}  // namespace

cv::Mat at_exposure_of(const cv::Mat& reference, const cv::Mat& view, const cv::Mat& d, const cv::Matx33f& H,
                       const cv::Vec3f& e, const cv::Mat& valid) {
  const std::vector<Pair> points = pairs(reference, view, d, H, e, valid);
  Line line;
  for (const double first : {40.0, 256.0}) {  // about equal exposures, and about any
    Line other;
    for (const double limit : {first, 40.0, 20.0}) {
      other = line_of(points, other, limit);
      if (!other.related) break;
    }
    if (other.related && other.used > line.used) line = other;
  }
  if (!line.related) return view;
  if (2 * line.used < points.size() || line.gain < kLeastGain || line.gain > 1 / kLeastGain) return view;
  double change = 0;
  for (const Pair& p : points) change += std::pow((line.gain - 1) * p.there + line.offset, 2);
  if (!(change > kDiffer * kDiffer * static_cast<double>(points.size()))) return view;
  cv::Mat even;
  view.convertTo(even, CV_8U, line.gain, line.offset);
  return even;
}

}  // namespace pade::depth
