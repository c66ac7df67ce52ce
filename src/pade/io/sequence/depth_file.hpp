// Files of true depth in the encodings that data sets publish: images, and arrays of NumPy.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// One channel of depth as stored, in counts of the file: CV_16UC1 or CV_32FC1. Understood are images of one
/// channel with 16 or 32 bit; PNGs whose four 8-bit channels are the bytes of a little-endian float
/// (TartanAir 2); and .npy arrays of rows x columns little-endian floats (TartanAir). Error where the file is
/// missing, cut short, or none of these.
Result<cv::Mat> read_depth_file(const std::filesystem::path& path);

/// The array of a .npy, of version 1 or 2 of NumPy's format; `file` is the name in messages.
Result<cv::Mat> parse_npy_depth(std::string_view bytes, const std::string& file);

}  // namespace pade::io
