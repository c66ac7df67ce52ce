#include "pade/checks/scene_hardness.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace pade::evaluation {
namespace {

/// 255 where the depth jumps to a neighbour on the right or below.
cv::Mat depth_edges(const cv::Mat& depth) {
  cv::Mat edges = cv::Mat::zeros(depth.size(), CV_8UC1);
  const auto jump = [](float a, float b) {
    return std::abs(a - b) > static_cast<float>(SceneHardness::edge_step) * std::min(a, b);
  };
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const float z = depth.at<float>(v, u);
      const bool right = u + 1 < depth.cols && jump(z, depth.at<float>(v, u + 1));
      const bool below = v + 1 < depth.rows && jump(z, depth.at<float>(v + 1, u));
      if (right || below) edges.at<std::uint8_t>(v, u) = 255;
    }
  }
  return edges;
}

void count_depths(const cv::Mat& depth, SceneHardness& counts) {
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const auto z = static_cast<double>(depth.at<float>(v, u));
      if (!(z > 0)) continue;
      counts.nearest = std::min(counts.nearest.value_or(z), z);
      const auto range = std::lower_bound(SceneHardness::ends.begin(), SceneHardness::ends.end(), z);
      if (range == SceneHardness::ends.end()) {
        ++counts.beyond;
      } else {
        ++counts.in_range[static_cast<std::size_t>(range - SceneHardness::ends.begin())];
      }
    }
  }
}

}  // namespace

SceneHardness& SceneHardness::operator+=(const SceneHardness& other) {
  pixels += other.pixels;
  for (std::size_t i = 0; i < in_range.size(); ++i) in_range[i] += other.in_range[i];
  beyond += other.beyond;
  flat += other.flat;
  near_edge += other.near_edge;
  if (other.nearest) nearest = std::min(nearest.value_or(*other.nearest), *other.nearest);
  return *this;
}

SceneHardness scene_hardness(const cv::Mat& image, const cv::Mat& depth) {
  SceneHardness counts;
  counts.pixels = static_cast<std::int64_t>(depth.total());
  count_depths(depth, counts);
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::Mat across;
  cv::Mat down;
  cv::Sobel(grey, across, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(grey, down, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::Mat gradient;
  cv::magnitude(across, down, gradient);
  counts.flat = cv::countNonZero(gradient < SceneHardness::low_gradient);
  cv::Mat near_edges;
  constexpr int kWidth = 2 * SceneHardness::edge_reach + 1;
  cv::dilate(depth_edges(depth), near_edges, cv::Mat::ones(kWidth, kWidth, CV_8U));
  counts.near_edge = cv::countNonZero(near_edges);
  return counts;
}

Result<SceneHardness> scene_hardness(const io::Sequence& sequence, int frames) {
  SceneHardness total;
  std::string first_reason;
  const std::size_t step =
      std::max<std::size_t>(1, sequence.size() / static_cast<std::size_t>(std::max(frames, 1)));
  for (std::size_t i = 0; i < sequence.size(); i += step) {
    const Result<cv::Mat> depth = sequence.truth(i);
    if (!depth) {
      if (first_reason.empty()) first_reason = "; first: " + depth.error().message;
      continue;
    }
    const auto frame = sequence.frame(i);
    if (frame) total += scene_hardness(frame->image, *depth);
  }
  if (total.pixels == 0)
    return Error{fmt::format("{}: found no frame with true depth that can be used, expected one{}",
                             sequence.folder().string(), first_reason)};
  return total;
}

std::string to_line(const SceneHardness& hardness) {
  const auto percent = [&](std::int64_t count) { return 100 * hardness.share(count); };
  const auto& n = hardness.in_range;
  return fmt::format("{:5.1f} {:5.1f} {:5.1f} {:5.1f} {:5.1f}  {:5.1f} {:5.1f}  {:7.2f}", percent(n[0]),
                     percent(n[1]), percent(n[2]), percent(n[3]), percent(hardness.beyond),
                     percent(hardness.flat), percent(hardness.near_edge), hardness.nearest.value_or(0));
}

}  // namespace pade::evaluation
