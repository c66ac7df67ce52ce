// Image formats that only OpenCV's imgcodecs reads, through a module that is loaded when one of them comes.
#pragma once

#include "pade/io/image/image_codec.hpp"

namespace pade::io {

/// What the bytes begin like: "TIFF", "WebP", ... Empty for what OpenCV does not know either, and for PNG,
/// JPEG and binary PGM and PPM.
std::string_view other_format_of(ImageBytes bytes);

/// Bytes of such a format. The error names the format, and the package if the module is not there.
Result<cv::Mat> decode_other_format(ImageBytes bytes, Pixels pixels);

/// The bytes of a file whose name ends in `ending` (".bmp"), or why there are none.
Result<std::vector<std::uint8_t>> encode_other_format(const std::string& ending, const cv::Mat& image);
/// Whether there would be some.
Status check_other_ending(const std::string& ending);

}  // namespace pade::io
