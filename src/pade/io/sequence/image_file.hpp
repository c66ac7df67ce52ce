// Image files: reading them whole or not at all. A decoder may return a partly grey picture for a file that
// was cut short; a frame of half an image would put false obstacles into the map, so the file is checked
// first.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// What the header of an image file says.
struct ImageInfo {
  cv::Size size;
  int bits = 8;      ///< of a channel as read by read_image: 8, 16 or 32 (floating point)
  int channels = 1;  ///< as read by read_image: 1 or 3
};

/// Reads only the head and the tail of PNG, JPEG and binary PGM/PPM files (others are decoded). Error if
/// the file is missing, empty, of no known format or cut short.
Result<ImageInfo> inspect_image(const std::filesystem::path& path);

/// The image as stored: 8, 16 or 32 bit, 1 or 3 (BGR) channels, transparency dropped, EXIF orientation
/// ignored (a calibration belongs to the sensor's pixels). Error if the file is missing, empty, cut short
/// or corrupt: the checksums of PNG are verified.
Result<cv::Mat> read_image(const std::filesystem::path& path);

/// @{
/// The same of the bytes of such a file; `name` stands in messages.
Result<ImageInfo> inspect_image_bytes(std::string_view bytes, const std::string& name);
Result<cv::Mat> read_image_bytes(std::string_view bytes, const std::string& name);
/// @}

}  // namespace pade::io
