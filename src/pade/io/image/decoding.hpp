// What the readers of the formats have in common.
#pragma once

#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include "pade/io/image/image_codec.hpp"

namespace pade::io {

/// The type of the matrix that is asked for where the file has `stored`.
inline int wanted_type(int stored, Pixels pixels) {
  const int channels = CV_MAT_CN(stored) > 1 ? 3 : 1;
  switch (pixels) {
    case Pixels::stored:
      break;
    case Pixels::opaque:
      return CV_MAKETYPE(CV_MAT_DEPTH(stored), channels);
    case Pixels::grey:
      return CV_8UC1;
    case Pixels::colour:
      return CV_8UC3;
  }
  return stored;
}

/// OpenCV's limits: a header may state anything, and memory is taken for it.
inline Status check_image_size(std::uint64_t width, std::uint64_t height, std::string_view format) {
  constexpr std::uint64_t kLongest = 1U << 20U, kMost = 1U << 30U;
  if (width > 0 && height > 0 && width <= kLongest && height <= kLongest && width * height <= kMost)
    return {};
  return Error{fmt::format("the {} header states {} x {} pixels, expected 1 to {} each and at most {} in all",
                           format, width, height, kLongest, kMost)};
}

/// @{
/// Grey of 8-bit colours as OpenCV's image files have it, 14 bits behind the point.
inline constexpr int kGreyOfRed = 4899, kGreyOfGreen = 9617, kGreyOfBlue = 1868;
inline std::uint8_t grey_of(int red, int green, int blue) {
  return static_cast<std::uint8_t>((red * kGreyOfRed + green * kGreyOfGreen + blue * kGreyOfBlue + 8192) >>
                                   14);
}
/// @}

/// @{
/// One reader per format; the bytes begin with its signature.
Result<cv::Mat> decode_png(ImageBytes bytes, Pixels pixels);
Result<cv::Mat> decode_jpeg(ImageBytes bytes, Pixels pixels);
Result<cv::Mat> decode_pnm(ImageBytes bytes, Pixels pixels);
/// @}

}  // namespace pade::io
