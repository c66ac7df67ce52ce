// What the program and its module for the other formats (opencv_module.cpp) agree on.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/version.hpp"
#include "pade/io/image/image_codec.hpp"

namespace pade::io {

/// The functions of the module; none of them throws.
struct OtherFormats {
  /// Of the build. A cv::Mat is what both sides take it for only if they agree.
  std::string_view pade = version, opencv = CV_VERSION;
  /// Empty where OpenCV cannot read it; then `why` may say more.
  cv::Mat (*decode)(ImageBytes bytes, Pixels pixels, std::string& why) = nullptr;
  /// The bytes of a file whose name ends so; empty where OpenCV cannot.
  std::vector<std::uint8_t> (*encode)(const std::string& ending, const cv::Mat& image,
                                      std::string& why) = nullptr;
  /// Whether OpenCV writes files whose name ends so.
  bool (*encodes)(const std::string& ending) = nullptr;
};

/// The module's one symbol.
inline constexpr const char* other_formats_symbol = "pade_other_image_formats";

}  // namespace pade::io
