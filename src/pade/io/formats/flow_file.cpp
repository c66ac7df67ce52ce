#include "pade/io/formats/flow_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

static_assert(std::endian::native == std::endian::little, "flow files are little-endian");

constexpr float kUnknownAbove = 1e9F;
constexpr float kUnknown = 1.666666752e9F;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr std::int32_t kLargestSide = 32768;
constexpr std::size_t kHeaderBytes = 12;

constexpr float kKittiScale = 64.0F;
constexpr float kKittiOffset = 32768.0F;

std::span<const std::uint8_t> as_bytes(const std::string& content) {
  return {reinterpret_cast<const std::uint8_t*>(content.data()), content.size()};
}

std::uint64_t big_endian(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes[at + i];
  return value;
}

// Whether the bytes can be a PNG of 16-bit RGB at all. The decoder would take any format, and believe
// any size.
Status check_png_header(std::span<const std::uint8_t> bytes, std::string_view name) {
  constexpr std::array<std::uint8_t, 16> start = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                                  0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  constexpr std::size_t header_bytes = 33;
  if (bytes.size() < header_bytes || !std::equal(start.begin(), start.end(), bytes.begin())) {
    return Error{fmt::format("{}: not a readable PNG", name)};
  }
  const std::uint64_t width = big_endian(bytes, 16);
  const std::uint64_t height = big_endian(bytes, 20);
  const int depth = bytes[24];
  const int color = bytes[25];
  if (depth != 16 || color != 2) {
    return Error{
        fmt::format("{}: PNG of colour type {} with {} bits, expected a KITTI flow PNG (type 2, 16 bits)",
                    name, color, depth)};
  }
  constexpr std::uint64_t best_compression = 1040;  // what deflate can reach
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide ||
      width * height * 6 > bytes.size() * best_compression) {
    return Error{fmt::format("{}: size {} x {}, more than its {} bytes can hold or beyond {}", name, width,
                             height, bytes.size(), kLargestSide)};
  }
  return {};
}

}  // namespace

Result<cv::Mat> decode_flo(std::span<const std::uint8_t> bytes, std::string_view name) {
  if (bytes.size() < kHeaderBytes) {
    return Error{fmt::format("{}: {} bytes, expected a .flo header of {}", name, bytes.size(), kHeaderBytes)};
  }
  if (std::memcmp(bytes.data(), "PIEH", 4) != 0) return Error{fmt::format("{}: no .flo tag 'PIEH'", name)};
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::memcpy(&width, bytes.data() + 4, 4);
  std::memcpy(&height, bytes.data() + 8, 4);
  if (width < 1 || height < 1 || width > kLargestSide || height > kLargestSide) {
    return Error{fmt::format("{}: size {} x {}, expected 1 to {} each", name, width, height, kLargestSide)};
  }
  const std::size_t row_bytes = static_cast<std::size_t>(width) * sizeof(cv::Vec2f);
  const std::size_t expected = kHeaderBytes + row_bytes * static_cast<std::size_t>(height);
  if (bytes.size() != expected) {
    return Error{
        fmt::format("{}: {} bytes, expected {} for {} x {}", name, bytes.size(), expected, width, height)};
  }
  cv::Mat vectors(height, width, CV_32FC2);
  std::memcpy(vectors.data, bytes.data() + kHeaderBytes, expected - kHeaderBytes);
  vectors.forEach<cv::Vec2f>([](cv::Vec2f& w, const int*) {
    // Written so that NaN is unknown too.
    if (!(std::abs(w[0]) <= kUnknownAbove && std::abs(w[1]) <= kUnknownAbove)) w = {kNone, kNone};
  });
  return vectors;
}

std::vector<std::uint8_t> encode_flo(const cv::Mat& vectors) {
  CV_Assert(vectors.type() == CV_32FC2 && !vectors.empty());
  const std::int32_t size[2] = {vectors.cols, vectors.rows};
  std::vector<std::uint8_t> bytes(kHeaderBytes + vectors.total() * sizeof(cv::Vec2f));
  std::memcpy(bytes.data(), "PIEH", 4);
  std::memcpy(bytes.data() + 4, size, 8);
  std::uint8_t* to = bytes.data() + kHeaderBytes;
  for (int v = 0; v < vectors.rows; ++v) {
    for (int u = 0; u < vectors.cols; ++u, to += sizeof(cv::Vec2f)) {
      cv::Vec2f w = vectors.at<cv::Vec2f>(v, u);
      if (!(std::abs(w[0]) <= kUnknownAbove && std::abs(w[1]) <= kUnknownAbove)) w = {kUnknown, kUnknown};
      std::memcpy(to, w.val, sizeof(cv::Vec2f));
    }
  }
  return bytes;
}

Result<cv::Mat> decode_kitti_flow(std::span<const std::uint8_t> bytes, std::string_view name) {
  if (const Status header = check_png_header(bytes, name); !header) return header.error();
  const auto decoded = decode_image(bytes, Pixels::stored);
  if (!decoded) return Error{fmt::format("{}: {}", name, decoded.error().message)};
  const cv::Mat& png = *decoded;
  if (png.type() != CV_16UC3) {
    return Error{fmt::format("{}: {} channels of {} bytes, expected a KITTI flow PNG with 3 of 2", name,
                             png.channels(), png.elemSize1())};
  }
  cv::Mat vectors(png.size(), CV_32FC2);
  for (int v = 0; v < png.rows; ++v) {
    for (int u = 0; u < png.cols; ++u) {
      const auto& code = png.at<cv::Vec3w>(v, u);  // BGR: valid, v, u
      vectors.at<cv::Vec2f>(v, u) =
          code[0] == 0 ? cv::Vec2f(kNone, kNone)
                       : cv::Vec2f((static_cast<float>(code[2]) - kKittiOffset) / kKittiScale,
                                   (static_cast<float>(code[1]) - kKittiOffset) / kKittiScale);
    }
  }
  return vectors;
}

std::vector<std::uint8_t> encode_kitti_flow(const cv::Mat& vectors) {
  CV_Assert(vectors.type() == CV_32FC2 && !vectors.empty());
  cv::Mat png(vectors.size(), CV_16UC3, cv::Scalar::all(0));
  for (int v = 0; v < png.rows; ++v) {
    for (int u = 0; u < png.cols; ++u) {
      const cv::Vec2f code =
          vectors.at<cv::Vec2f>(v, u) * kKittiScale + cv::Vec2f(kKittiOffset, kKittiOffset);
      const bool fits = code[0] > -0.5F && code[1] > -0.5F && code[0] < 65535.5F && code[1] < 65535.5F;
      if (!fits) continue;
      png.at<cv::Vec3w>(v, u) = {1, static_cast<std::uint16_t>(std::lround(code[1])),
                                 static_cast<std::uint16_t>(std::lround(code[0]))};
    }
  }
  return encode_png(png);
}

Result<cv::Mat> read_flow(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending != ".flo" && ending != ".png") {
    return Error{fmt::format("{}: flow files end in .flo or .png", file.string())};
  }
  const Result<std::string> content = read_file(file);
  if (!content) return content.error();
  const std::span<const std::uint8_t> bytes = as_bytes(*content);
  return ending == ".flo" ? decode_flo(bytes, file.string()) : decode_kitti_flow(bytes, file.string());
}

Status write_flow(const std::filesystem::path& file, const cv::Mat& vectors) {
  if (vectors.type() != CV_32FC2 || vectors.empty()) {
    return Error{fmt::format("{}: the flow to write is empty or not of type CV_32FC2", file.string())};
  }
  const std::string ending = file.extension().string();
  if (ending != ".flo" && ending != ".png") {
    return Error{fmt::format("{}: flow files end in .flo or .png", file.string())};
  }
  const std::vector<std::uint8_t> bytes = ending == ".flo" ? encode_flo(vectors) : encode_kitti_flow(vectors);
  return write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, Overwrite::replace);
}

}  // namespace pade::io
