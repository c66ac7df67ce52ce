#include "pade/io/sequence/depth_file.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>

#include <Eigen/Core>
#include <fmt/format.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/image_file.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

static_assert(std::endian::native == std::endian::little,
              "floats are taken from the files as they lie there");

/// The text behind 'key': in the header of a .npy, a Python dictionary.
std::string_view value_of(std::string_view header, std::string_view key) {
  const std::size_t found = header.find(key);
  if (found == std::string_view::npos) return {};
  header.remove_prefix(found + key.size());
  header.remove_prefix(std::min(header.find_first_not_of(" :"), header.size()));
  return header;
}

/// "(480, 640)"
cv::Size shape_of(std::string_view text) {
  int rows = 0;
  int columns = 0;
  if (!text.starts_with('(')) return {};
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data() + 1, end, rows);
  if (first.ec != std::errc{} || end - first.ptr < 2 || std::string_view(first.ptr, 2) != ", ") return {};
  const auto second = std::from_chars(first.ptr + 2, end, columns);
  if (second.ec != std::errc{} || second.ptr == end || *second.ptr != ')') return {};
  return {columns, rows};
}

/// Bytes of a number of '<f2', '<f4' or '<f8'; 0 for other types.
std::size_t float_size(std::string_view type) {
  for (const std::size_t size : {std::size_t{2}, std::size_t{4}, std::size_t{8}}) {
    if (type.starts_with(fmt::format("'<f{}'", size))) return size;
  }
  return 0;
}

template <class T>
void convert(std::string_view bytes, cv::Mat& depth) {
  T value;
  for (std::size_t i = 0; i < depth.total(); ++i) {
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    depth.ptr<float>()[i] = static_cast<float>(value);
  }
}

/// Four channels of a byte are a float; empty where the image is none such.
cv::Mat float_of_bytes(const std::string& bytes) {
  const auto image = decode_image(image_bytes(bytes), Pixels::stored);
  if (!image || image->type() != CV_8UC4 || !image->isContinuous()) return {};
  cv::Mat depth(image->size(), CV_32FC1);
  std::memcpy(depth.data, image->data, image->total() * image->elemSize());
  return depth;
}

}  // namespace

Result<cv::Mat> parse_npy_depth(std::string_view bytes, const std::string& file) {
  const auto named = [&](const std::string& what) { return Error{fmt::format("{}: {}", file, what)}; };
  constexpr std::string_view kExpected =
      "expected a .npy array of rows x columns little-endian floats ('<f2', '<f4' or '<f8', in C order)";
  if (bytes.size() < 12 || !bytes.starts_with("\x93NUMPY")) return named(std::string(kExpected));
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i]));
  };
  const bool one = byte(6) == 1;
  const std::size_t length = byte(8) | byte(9) << 8U | (one ? 0 : byte(10) << 16U | byte(11) << 24U);
  bytes.remove_prefix(one ? 10 : 12);
  if (length > bytes.size()) return named("the .npy is cut short within its header");
  const std::string_view header = bytes.substr(0, length);
  bytes.remove_prefix(length);
  const cv::Size size = shape_of(value_of(header, "'shape'"));
  constexpr int kLongest = 1 << 16;
  const std::size_t each = float_size(value_of(header, "'descr'"));
  if (each == 0 || !value_of(header, "'fortran_order'").starts_with("False") || size.width < 1 ||
      size.height < 1 || size.width > kLongest || size.height > kLongest) {
    return named(fmt::format("found {}, {}", in_quotes(header), kExpected));
  }
  const std::size_t count = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  if (bytes.size() < each * count) {
    return named(
        fmt::format("the .npy is cut short: {} bytes of values, expected {}", bytes.size(), each * count));
  }
  cv::Mat depth(size, CV_32FC1);
  if (each == sizeof(float)) {
    std::memcpy(depth.data, bytes.data(), each * count);
  } else if (each == sizeof(double)) {
    convert<double>(bytes, depth);
  } else {
    convert<Eigen::half>(bytes, depth);
  }
  return depth;
}

Result<cv::Mat> read_depth_file(const std::filesystem::path& path) {
  const auto named = [&](const std::string& what) {
    return Error{fmt::format("{}: {}", path.string(), what)};
  };
  if (path.extension() == ".npy") {
    const auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    return parse_npy_depth(*bytes, path.string());
  }
  auto image = read_image(path);  // verifies the file, and drops a fourth channel
  if (!image) return image;
  if (image->type() == CV_16UC1 || image->type() == CV_32FC1) return image;
  if (image->type() == CV_8UC3) {
    const auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    if (cv::Mat depth = float_of_bytes(*bytes); !depth.empty()) return depth;
  }
  return named(fmt::format("the depth image has {} channels of {} bits, expected one of 16 or 32",
                           image->channels(), 8 * image->elemSize1()));
}

}  // namespace pade::io
