// Images that a command takes one by one.
#pragma once

#include <string>

#include <fmt/format.h>

#include "pade/core/result.hpp"
#include "pade/io/image/image_codec.hpp"

namespace pade::cli {

/// CV_8UC1, or the error that names the file.
inline Result<cv::Mat> read_grey(const std::string& file) { return io::load_image(file, io::Pixels::grey); }

}  // namespace pade::cli
