#include "pade/io/sequence/frame_mask.hpp"

#include <cstddef>
#include <cstdint>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/io/sequence/image_file.hpp"

namespace pade::io {
namespace {

/// 255 where every channel is 0.
cv::Mat is_black(const cv::Mat& image) {
  cv::Mat black;
  cv::inRange(image, cv::Scalar::all(0), cv::Scalar::all(0), black);
  return black;
}

/// Without the connected parts that are small and do not touch the border of the image.
cv::Mat without_specks(const cv::Mat& black) {
  constexpr int kSpeck = 16;  // pixels
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(black, labels, stats, centroids, 8, CV_32S);
  std::vector<std::uint8_t> keep(static_cast<std::size_t>(count), 0);
  for (int i = 1; i < count; ++i) {
    const int* const part = stats.ptr<int>(i);
    const bool at_border = part[cv::CC_STAT_LEFT] == 0 || part[cv::CC_STAT_TOP] == 0 ||
                           part[cv::CC_STAT_LEFT] + part[cv::CC_STAT_WIDTH] == black.cols ||
                           part[cv::CC_STAT_TOP] + part[cv::CC_STAT_HEIGHT] == black.rows;
    keep[static_cast<std::size_t>(i)] = at_border || part[cv::CC_STAT_AREA] > kSpeck ? 255 : 0;
  }
  cv::Mat solid(black.size(), CV_8UC1);
  for (int row = 0; row < black.rows; ++row) {
    const int* const from = labels.ptr<int>(row);
    auto* const to = solid.ptr<std::uint8_t>(row);
    for (int i = 0; i < black.cols; ++i) to[i] = keep[static_cast<std::size_t>(from[i])];
  }
  return solid;
}

/// Valid pixels (255) at least `radius` away from invalid ones; the border of the image is no obstacle.
cv::Mat shrunk(const cv::Mat& valid, int radius) {
  if (radius <= 0) return valid;
  cv::Mat out;
  cv::erode(valid, out, cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1}));
  return out;
}

}  // namespace

cv::Mat black_in_every_image(const std::vector<std::filesystem::path>& files, const ImageStore& store,
                             cv::Size size) {
  cv::Mat black(size, CV_8UC1, cv::Scalar(255));
  bool any = false;
  for (const auto& file : files) {
    const auto image = store.read(file);
    if (!image || image->size() != size) continue;
    any = true;
    cv::bitwise_and(black, is_black(*image), black);
    if (cv::countNonZero(black) == 0) break;
  }
  if (!any) return cv::Mat::zeros(size, CV_8UC1);
  return without_specks(black);
}

cv::Mat undistorted_mask(const cv::Mat& recorded, bool grow_recorded, const Camera& camera,
                         const Undistorter& undistorter, int radius) {
  const cv::Mat lens =
      undistorter.valid().empty() ? cv::Mat(camera.size(), CV_8UC1, cv::Scalar(255)) : undistorter.valid();
  if (recorded.empty()) return shrunk(lens, radius).clone();
  // Interpolation mixes up to four recorded pixels: valid only where all of them are.
  const cv::Mat seen = undistorter(recorded) == 255;
  if (grow_recorded) return shrunk(lens & seen, radius);
  return shrunk(lens, radius) & seen;
}

Result<cv::Mat> read_mask(const std::filesystem::path& file, cv::Size size) {
  const auto image = read_image(file);
  if (!image) return image.error();
  if (image->size() != size) {
    return Error{fmt::format("{}: the mask has {} x {} pixels, expected {} x {} as the images", file.string(),
                             image->cols, image->rows, size.width, size.height)};
  }
  return cv::Mat(~is_black(*image));
}

}  // namespace pade::io
