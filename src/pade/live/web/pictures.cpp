#include "pade/live/web/pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "pade/io/image/image_codec.hpp"

namespace pade::live {
namespace {

constexpr int kWidest = 640;  // px, of pictures
constexpr int kJpegQuality = 60;
const cv::Vec3b kRed(40, 40, 230), kYellow(30, 200, 240), kNoDepth(48, 44, 44);

/// Depth and variance as large as the picture, each pixel that of its cell.
cv::Mat of_size(const cv::Mat& cells, cv::Size size) {
  if (cells.empty() || cells.size() == size) return cells;
  cv::Mat full;
  cv::resize(cells, full, size, 0, 0, cv::INTER_NEAREST);
  return full;
}

/// Sigma as a share of what may be shown, 0 to 1; above: not to be shown, as of NaN.
float doubt(float depth, float variance) {
  const float share = std::sqrt(variance) / (kShownRelativeSigma * depth);
  return share >= 0 ? share : 2;
}

std::array<cv::Vec3b, 256> colours_of_depth() {
  cv::Mat steps(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) steps.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  cv::Mat coloured;
  cv::applyColorMap(steps, coloured, cv::COLORMAP_TURBO);
  std::array<cv::Vec3b, 256> colours;
  for (int i = 0; i < 256; ++i) colours[static_cast<std::size_t>(i)] = coloured.at<cv::Vec3b>(0, i);
  return colours;
}

}  // namespace

cv::Mat obstacle_picture(const cv::Mat& image, const cv::Mat& depth, const cv::Mat& variance) {
  cv::Mat picture;
  if (image.channels() == 1) {
    cv::cvtColor(image, picture, cv::COLOR_GRAY2BGR);
  } else {
    picture = image.clone();
  }
  if (depth.empty()) return picture;
  const cv::Mat z = of_size(depth, picture.size());
  const cv::Mat var = of_size(variance, picture.size());
  for (int v = 0; v < picture.rows; ++v) {
    auto* const row = picture.ptr<cv::Vec3b>(v);
    const auto* const depths = z.ptr<float>(v);
    const auto* const variances = var.ptr<float>(v);
    for (int u = 0; u < picture.cols; ++u) {
      if (!(depths[u] < kYellowDistance) || doubt(depths[u], variances[u]) > 1) continue;
      const cv::Vec3b& veil = depths[u] < kRedDistance ? kRed : kYellow;
      for (int c = 0; c < 3; ++c) row[u][c] = static_cast<std::uint8_t>((row[u][c] + veil[c]) / 2);
    }
  }
  return picture;
}

cv::Mat depth_picture(const cv::Mat& depth, const cv::Mat& variance, cv::Size size) {
  static const std::array<cv::Vec3b, 256> kColours = colours_of_depth();
  constexpr float kNearest = 1, kFarthest = 20;  // m: ends of the colours, which go by 1 / Z
  constexpr float kDarkest = 25;                 // what is below cannot be told from none
  cv::Mat picture(size, CV_8UC3, cv::Scalar(kNoDepth[0], kNoDepth[1], kNoDepth[2]));
  if (depth.empty()) return picture;
  const cv::Mat z = of_size(depth, size);
  const cv::Mat var = of_size(variance, size);
  for (int v = 0; v < size.height; ++v) {
    auto* const row = picture.ptr<cv::Vec3b>(v);
    const auto* const depths = z.ptr<float>(v);
    const auto* const variances = var.ptr<float>(v);
    for (int u = 0; u < size.width; ++u) {
      const float pale = doubt(depths[u], variances[u]);
      if (pale > 1) continue;
      const float near = (1 / depths[u] - 1 / kFarthest) / (1 / kNearest - 1 / kFarthest);
      const cv::Vec3b& colour =
          kColours[static_cast<std::size_t>(kDarkest + (255 - kDarkest) * std::clamp(near, 0.0F, 1.0F))];
      for (int c = 0; c < 3; ++c)
        row[u][c] =
            static_cast<std::uint8_t>(static_cast<float>(colour[c]) * (1 - 0.7F * pale) + 255 * 0.7F * pale);
    }
  }
  return picture;
}

cv::Mat small_picture(const cv::Mat& picture) {
  if (picture.cols <= kWidest) return picture;
  cv::Mat small;
  const int height =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(picture.rows) * kWidest / picture.cols)));
  cv::resize(picture, small, {kWidest, height}, 0, 0, cv::INTER_AREA);
  return small;
}

std::string jpeg_of(const cv::Mat& picture) {
  const auto bytes = io::encode_jpeg(picture, kJpegQuality);
  return {bytes.begin(), bytes.end()};
}

}  // namespace pade::live
