// Optical-flow files: Middlebury .flo (32-bit floats, lossless) and the KITTI 16-bit PNG (1/64 px, +-512 px).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// Decodes a .flo file (Baker et al. 2011): "PIEH", int32 width and height, then u and v interleaved row by
/// row, little-endian floats. Unknown flow (|u| or |v| > 1e9, or NaN) becomes NaN in both components.
/// @param bytes  the whole file. @param name  stands in front of error messages.
/// @return CV_32FC2, pixels. Error: wrong tag, size outside 1..32768, or not exactly as long as the size
/// says.
Result<cv::Mat> decode_flo(std::span<const std::uint8_t> bytes, std::string_view name);

/// The bytes of a .flo file. NaN becomes the format's unknown value 1.666666752e9.
/// @param vectors  CV_32FC2, not empty.
std::vector<std::uint8_t> encode_flo(const cv::Mat& vectors);

/// Decodes a KITTI flow PNG (Geiger et al. 2012): 16-bit RGB with u = (R - 32768) / 64, v likewise from G,
/// and B = 0 where the flow is unknown (NaN here).
Result<cv::Mat> decode_kitti_flow(std::span<const std::uint8_t> bytes, std::string_view name);

/// The bytes of a KITTI flow PNG. Vectors that are NaN or outside the format's [-512, 512) px are unknown
/// there.
std::vector<std::uint8_t> encode_kitti_flow(const cv::Mat& vectors);

/// Reads a flow file; the ending .flo or .png names its format.
/// @return CV_32FC2, pixels, NaN = unknown.
Result<cv::Mat> read_flow(const std::filesystem::path& file);

/// Writes a flow file; the ending .flo or .png names its format. The file appears whole or not at all.
/// @param vectors  CV_32FC2, pixels, NaN = unknown.
Status write_flow(const std::filesystem::path& file, const cv::Mat& vectors);

}  // namespace pade::io
