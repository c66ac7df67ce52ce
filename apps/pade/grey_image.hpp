// Images that a command takes one by one.
#pragma once

#include <string>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "pade/core/result.hpp"

namespace pade::cli {

/// CV_8UC1, or the error that names the file.
inline Result<cv::Mat> read_grey(const std::string& file) {
  cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (image.empty()) return Error{fmt::format("{}: not a readable image", file)};
  return image;
}

}  // namespace pade::cli
