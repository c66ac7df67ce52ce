#include "pade/io/formats/flow_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace pade::io {
namespace {

constexpr int kHues = 55;
using Wheel = std::array<cv::Vec3f, kHues>;  // BGR, 0 to 1

// Six linear ramps between the primaries; their lengths follow how well the eye tells the hues apart.
Wheel make_wheel() {
  constexpr std::array<int, 6> lengths = {15, 6, 4, 11, 13, 6};  // RY YG GC CB BM MR
  constexpr std::array<std::array<float, 3>, 7> corners = {
      {{0, 0, 1}, {0, 1, 1}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}};
  Wheel wheel;
  std::size_t hue = 0;
  for (std::size_t ramp = 0; ramp < lengths.size(); ++ramp) {
    for (int i = 0; i < lengths[ramp]; ++i, ++hue) {
      const float part = static_cast<float>(i) / static_cast<float>(lengths[ramp]);
      for (std::size_t c = 0; c < 3; ++c) {
        wheel[hue][static_cast<int>(c)] = (1 - part) * corners[ramp][c] + part * corners[ramp + 1][c];
      }
    }
  }
  return wheel;
}

cv::Vec3b color(const Wheel& wheel, float u, float v) {
  if (!std::isfinite(u) || !std::isfinite(v)) return {0, 0, 0};
  const float length = std::hypot(u, v);
  const float turn = (std::atan2(-v, -u) / std::numbers::pi_v<float> + 1) / 2;
  const float position = turn * (kHues - 1);
  const auto lower = static_cast<std::size_t>(std::clamp(position, 0.0F, kHues - 1.0F));
  const float part = position - static_cast<float>(lower);
  cv::Vec3b bgr;
  for (int c = 0; c < 3; ++c) {
    const float hue = (1 - part) * wheel[lower][c] + part * wheel[(lower + 1) % kHues][c];
    const float shade = length <= 1 ? 1 - length * (1 - hue) : 0.75F * hue;
    bgr[c] = cv::saturate_cast<std::uint8_t>(255 * shade);
  }
  return bgr;
}

// A disc of `radius` pixels whose rim is the full scale; white around it.
cv::Mat draw_wheel(int radius) {
  const int side = 2 * radius + 1;
  cv::Mat vectors(side, side, CV_32FC2);
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) {
      vectors.at<cv::Vec2f>(v, u) = {static_cast<float>(u - radius), static_cast<float>(v - radius)};
    }
  }
  cv::Mat disc = flow_colors(vectors, radius);
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) {
      if (std::hypot(u - radius, v - radius) > radius) disc.at<cv::Vec3b>(v, u) = {255, 255, 255};
    }
  }
  return disc;
}

}  // namespace

cv::Mat flow_colors(const cv::Mat& vectors, double full_scale) {
  CV_Assert(vectors.type() == CV_32FC2 && full_scale > 0);
  static const Wheel wheel = make_wheel();
  const auto scale = static_cast<float>(1 / full_scale);
  cv::Mat bgr(vectors.size(), CV_8UC3);
  for (int v = 0; v < vectors.rows; ++v) {
    for (int u = 0; u < vectors.cols; ++u) {
      const auto& w = vectors.at<cv::Vec2f>(v, u);
      bgr.at<cv::Vec3b>(v, u) = color(wheel, w[0] * scale, w[1] * scale);
    }
  }
  return bgr;
}

double flow_full_scale(const cv::Mat& vectors) {
  CV_Assert(vectors.type() == CV_32FC2);
  std::vector<float> lengths;
  lengths.reserve(vectors.total());
  for (int v = 0; v < vectors.rows; ++v) {
    for (int u = 0; u < vectors.cols; ++u) {
      const auto& w = vectors.at<cv::Vec2f>(v, u);
      const float length = std::hypot(w[0], w[1]);
      if (std::isfinite(length)) lengths.push_back(length);
    }
  }
  if (lengths.empty()) return 1;
  const auto nth =
      lengths.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(lengths.size() - 1));
  std::nth_element(lengths.begin(), nth, lengths.end());
  const double length = std::max(static_cast<double>(*nth), 1e-3);
  const double decade = std::pow(10.0, std::floor(std::log10(length)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (length <= step * decade * (1 + 1e-6)) return step * decade;
  }
  return 10 * decade;
}

cv::Mat flow_picture(const cv::Mat& vectors, double full_scale) {
  constexpr int kRadius = 40;
  constexpr int kMargin = 8;
  constexpr int kText = 22;
  constexpr int kPanel = 2 * (kRadius + kMargin) + 1;
  if (!(full_scale > 0)) full_scale = flow_full_scale(vectors);
  const int height = std::max(vectors.rows, 2 * kMargin + 2 * kRadius + 1 + kText);
  cv::Mat picture(height, vectors.cols + kPanel, CV_8UC3, cv::Scalar::all(255));
  if (!vectors.empty()) {
    flow_colors(vectors, full_scale).copyTo(picture(cv::Rect(0, 0, vectors.cols, vectors.rows)));
  }
  draw_wheel(kRadius).copyTo(
      picture(cv::Rect(vectors.cols + kMargin, kMargin, 2 * kRadius + 1, 2 * kRadius + 1)));
  const std::string text = fmt::format("{:g} px", full_scale);
  int baseline = 0;
  const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.45, 1, &baseline);
  cv::putText(picture, text,
              {vectors.cols + (kPanel - extent.width) / 2, 2 * kMargin + 2 * kRadius + 1 + extent.height},
              cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(0), 1, cv::LINE_AA);
  return picture;
}

}  // namespace pade::io
