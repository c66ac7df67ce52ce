#include "pade/io/recording/messages/image_messages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/io/recording/messages/pixel_encoding.hpp"
#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/sequence/image_file.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr int kAsItIs = -1;

/// Of the pixels in a CompressedImage, as image_transport writes it: "bayer_rggb8; jpeg compressed " for what
/// was sent, or "bayer_rggb8; jpeg compressed bgr8", where it was converted before.
std::string_view encoding_inside(std::string_view format) {
  constexpr std::string_view kKey = "compressed ";
  const std::size_t semicolon = format.find(';');
  if (semicolon == std::string_view::npos) return {};
  if (const std::size_t at = format.find(kKey, semicolon); at != std::string_view::npos) {
    const std::string_view inside = format.substr(at + kKey.size());
    const std::string_view word = inside.substr(0, inside.find(' '));
    if (!word.empty()) return word;
  }
  return format.substr(0, semicolon);
}

/// Pixels as they were sent, in grey or BGR.
Result<cv::Mat> converted(const cv::Mat& sent, const PixelEncoding& encoding) {
  if (encoding.conversion == kAsItIs) return sent.clone();
  cv::Mat pixels;
  try {  // OpenCV throws on sizes that a pattern cannot have
    cv::cvtColor(sent, pixels, encoding.conversion);
  } catch (const std::exception&) {
    return Error{fmt::format("{} x {} pixels of {} cannot be decoded", sent.cols, sent.rows, encoding.name)};
  }
  return pixels;
}

}  // namespace

const PixelEncoding* pixel_encoding(std::string_view name) {
  // OpenCV names a Bayer pattern by its second row.
  static constexpr std::array<PixelEncoding, 16> kKnown = {{
      {"mono8", CV_8UC1, kAsItIs},
      {"8UC1", CV_8UC1, kAsItIs},
      {"mono16", CV_16UC1, kAsItIs},
      {"bgr8", CV_8UC3, kAsItIs},
      {"8UC3", CV_8UC3, kAsItIs},
      {"rgb8", CV_8UC3, cv::COLOR_RGB2BGR},
      {"bgr16", CV_16UC3, kAsItIs},
      {"rgb16", CV_16UC3, cv::COLOR_RGB2BGR},
      {"bgra8", CV_8UC4, cv::COLOR_BGRA2BGR},
      {"rgba8", CV_8UC4, cv::COLOR_RGBA2BGR},
      {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2BGR},
      {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2BGR},
      {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2BGR},
      {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2BGR},
      {"yuv422", CV_8UC2, cv::COLOR_YUV2BGR_UYVY},
      {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2BGR_YUY2},
  }};
  const auto* const found = std::find_if(kKnown.begin(), kKnown.end(),
                                         [&](const PixelEncoding& known) { return known.name == name; });
  return found == kKnown.end() ? nullptr : found;
}

Result<ImageInfo> info_of(const ImageMessage& image) {
  const PixelEncoding* const encoding = pixel_encoding(image.encoding);
  if (encoding == nullptr) {
    return Error{
        fmt::format("found the encoding {}, expected mono8, mono16, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, "
                    "yuv422 or bayer_*8",
                    in_quotes(image.encoding))};
  }
  constexpr std::uint32_t kLongest = 1U << 20;
  if (image.width == 0 || image.height == 0 || image.width > kLongest || image.height > kLongest)
    return Error{fmt::format("the image states {} x {} pixels", image.width, image.height)};
  const bool grey = CV_MAT_CN(encoding->type) == 1 && encoding->conversion == kAsItIs;
  return ImageInfo{{static_cast<int>(image.width), static_cast<int>(image.height)},
                   CV_MAT_DEPTH(encoding->type) == CV_16U ? 16 : 8,
                   grey ? 1 : 3};
}

Result<const PixelEncoding*> mosaic_in(std::string_view format, std::string_view file,
                                       const std::string& name) {
  const std::string_view pixels = encoding_inside(format);
  if (!pixels.starts_with("bayer_")) return nullptr;
  const auto info = inspect_image_bytes(file, name);
  if (!info) return info.error();
  if (info->channels != 1) return nullptr;
  const PixelEncoding* const mosaic = pixel_encoding(pixels);
  if (mosaic == nullptr)
    return Error{fmt::format("{}: found the encoding {}, expected bayer_*8", name, in_quotes(pixels))};
  return mosaic;
}

Result<cv::Mat> pixels_of_file(std::string_view file, const PixelEncoding* mosaic, const std::string& name) {
  const auto stored = read_image_bytes(file, name);
  if (!stored || mosaic == nullptr) return stored;
  if (stored->depth() != CV_8U) {
    return Error{
        fmt::format("{}: found {} bits of a Bayer mosaic, expected 8", name, 8 * stored->elemSize1())};
  }
  auto colours = converted(*stored, *mosaic);
  if (!colours) return Error{fmt::format("{}: {}", name, colours.error().message)};
  return colours;
}

Result<cv::Mat> pixels_of(const ImageMessage& image) {
  const auto info = info_of(image);
  if (!info) return info.error();
  const PixelEncoding& encoding = *pixel_encoding(image.encoding);
  const std::size_t row = image.width * CV_ELEM_SIZE(encoding.type);
  if (image.step < row || image.data.size() / image.step < image.height) {
    return Error{fmt::format("the image has {} bytes in rows of {}, expected {} rows of {} at least",
                             image.data.size(), image.step, image.height, row)};
  }
  const cv::Mat view(info->size, encoding.type, const_cast<char*>(image.data.data()),
                     image.step);  // NOLINT: only read
  auto sent = converted(view, encoding);
  if (!sent) return sent.error();
  cv::Mat pixels = std::move(*sent);
  if (info->bits == 16 && image.big_endian != (std::endian::native == std::endian::big)) {
    for (int y = 0; y < pixels.rows; ++y) {
      auto* const values = pixels.ptr<std::uint16_t>(y);
      for (int i = 0; i < pixels.cols * pixels.channels(); ++i)
        values[i] = static_cast<std::uint16_t>(values[i] << 8 | values[i] >> 8);
    }
  }
  return pixels;
}

Result<cv::Mat> pixels_of(const CompressedImageMessage& image) {
  const std::string name = fmt::format("the compressed image ({})", in_quotes(image.format));
  const auto mosaic = mosaic_in(image.format, image.data, name);
  if (!mosaic) return mosaic.error();
  return pixels_of_file(image.data, *mosaic, name);
}

bool is_rectified(std::string_view topic) {
  while (!topic.empty()) {
    const std::size_t end = std::min(topic.find_first_of("/_"), topic.size());
    if (topic.substr(0, end) == "rect" || topic.substr(0, end) == "rectified") return true;
    topic.remove_prefix(std::min(end + 1, topic.size()));
  }
  return false;
}

Result<Camera> camera_of(const CameraInfoMessage& info, bool rectified) {
  if (info.binning_x > 1 || info.binning_y > 1 || info.x_offset > 0 || info.y_offset > 0)
    return Error{"the images are binned or cut, expected the calibration of the images as they are"};
  Camera camera;
  camera.width = static_cast<int>(std::min<std::uint32_t>(info.width, 1U << 20));
  camera.height = static_cast<int>(std::min<std::uint32_t>(info.height, 1U << 20));
  constexpr std::array<double, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (rectified && info.r != kIdentity) {
    return Error{
        "the rectified images are turned against the camera (R is not 1), which is not understood: take "
        "those that "
        "are not rectified"};
  }
  const auto& p = info.p;
  camera.fx = rectified ? p[0] : info.k[0];
  camera.cx = rectified ? p[2] : info.k[2];
  camera.fy = rectified ? p[5] : info.k[4];
  camera.cy = rectified ? p[6] : info.k[5];
  if (!(camera.fx > 0) || !(camera.fy > 0) || !std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy)) {
    return Error{
        fmt::format("found the focal lengths {} and {}, expected positive numbers: the camera was never "
                    "calibrated",
                    camera.fx, camera.fy)};
  }
  if (!rectified && std::abs(info.k[1]) > 1e-6 * camera.fx) return Error{"found a skew, expected none"};
  if (rectified || info.d.empty()) return camera;
  if (const auto problem = set_distortion(camera, info.model, info.d)) return Error{*problem};
  return camera;
}

}  // namespace pade::io
