// Image files as pixels, and back. PNG, JPEG and binary PGM/PPM are read here, by libpng and libjpeg; the
// other formats by a module that is loaded when such a file comes (other_formats.hpp), so that no process
// maps OpenCV's imgcodecs, and the hundred libraries behind it, for what may never come. Values are those of
// OpenCV 4.6.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// The bytes of a file.
using ImageBytes = std::span<const std::uint8_t>;
inline ImageBytes image_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// What is made of the pixels of a file. In brackets OpenCV's flags of the same meaning.
enum class Pixels {
  stored,  ///< bits and channels of the file, transparency too (IMREAD_UNCHANGED)
  opaque,  ///< bits of the file, 1 or 3 channels (IMREAD_ANYCOLOR | _ANYDEPTH | _IGNORE_ORIENTATION)
  grey,    ///< CV_8UC1, turned as EXIF says (IMREAD_GRAYSCALE)
  colour,  ///< CV_8UC3, turned as EXIF says (IMREAD_COLOR)
};

/// The image in such bytes; colours are BGR. The error says what is wrong, without a name: no known format,
/// cut short, corrupt, more than 2^20 pixels a side or 2^30 in all.
Result<cv::Mat> decode_image(ImageBytes bytes, Pixels pixels);
/// The image in a file; the error begins with its name.
Result<cv::Mat> load_image(const std::filesystem::path& file, Pixels pixels);

/// How a PNG is packed. The default is fast, and good for noise.
struct PngPacking {
  int level = 1;            ///< of deflate, 0 (none) to 9
  bool runs_only = true;    ///< deflate looks for runs of a byte and for nothing else
  bool left_filter = true;  ///< every pixel as the difference to its left neighbour; else libpng chooses
};

/// @{
/// The bytes of such a file. PNG: 8 or 16 bit, 1, 3 (BGR) or 4 (BGRA) channels. JPEG: 1 or 3 channels, values
/// beyond 0 to 255 are cut; quality 0 to 100. PGM and PPM: 8 or 16 bit, 1 or 3 channels. Other types, and an
/// empty image, are a mistake of the caller (cv::Exception); no bytes where the library refuses the size.
std::vector<std::uint8_t> encode_png(const cv::Mat& image, const PngPacking& packing = {});
std::vector<std::uint8_t> encode_jpeg(const cv::Mat& picture, int quality = 95);
std::vector<std::uint8_t> encode_pnm(const cv::Mat& image);
/// @}

/// Whether save_image() can write a file of this name, by its ending. The error says which endings it can.
Status check_image_name(const std::filesystem::path& file);
/// Writes the format that the name's ending says: .png, .jpg, .jpeg, .pgm, .ppm, or what the module for other
/// formats can.
Status save_image(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace pade::io
