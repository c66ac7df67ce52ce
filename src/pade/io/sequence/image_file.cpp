#include "pade/io/sequence/image_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "pade/io/crc32.hpp"
#include "pade/io/image/image_codec.hpp"

namespace pade::io {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kPngHead = 33;  // signature and IHDR chunk
constexpr std::array<std::uint8_t, 12> kPngEnd = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};

std::uint32_t big_endian(const std::uint8_t* bytes, int count) {
  std::uint32_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes[i];
  return value;
}

/// A file, or its bytes, of which only parts are read.
class ImageFile {
 public:
  static Result<ImageFile> open(const std::filesystem::path& file) {
    std::error_code failure;
    const auto status = std::filesystem::status(file, failure);
    if (!std::filesystem::exists(status)) return Error{"no such file"};
    if (!std::filesystem::is_regular_file(status)) return Error{"not a regular file"};
    ImageFile image;
    image.stream_.open(file, std::ios::binary);
    const std::uintmax_t size = std::filesystem::file_size(file, failure);
    if (failure || !image.stream_) return Error{"cannot be read"};
    if (size == 0) return Error{"the file is empty (0 bytes)"};
    image.size_ = static_cast<std::size_t>(size);
    return image;
  }

  static Result<ImageFile> of(std::string_view bytes) {
    if (bytes.empty()) return Error{"the image is empty (0 bytes)"};
    ImageFile image;
    image.memory_ = bytes;
    image.size_ = bytes.size();
    return image;
  }

  [[nodiscard]] std::size_t size() const { return size_; }

  /// Up to `count` bytes from `offset`; fewer where the file ends.
  Bytes read(std::size_t offset, std::size_t count) {
    Bytes bytes(offset < size_ ? std::min(count, size_ - offset) : 0);
    if (!memory_.empty()) {
      if (!bytes.empty()) std::memcpy(bytes.data(), memory_.data() + offset, bytes.size());
      return bytes;
    }
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    bytes.erase(bytes.begin() + stream_.gcount(), bytes.end());
    return bytes;
  }

 private:
  std::ifstream stream_;
  std::string_view memory_;  // instead of the stream
  std::size_t size_ = 0;
};

bool is_png(const Bytes& head) {
  return head.size() >= kPngSignature.size() &&
         std::equal(kPngSignature.begin(), kPngSignature.end(), head.begin());
}
bool is_jpeg(const Bytes& head) {
  return head.size() >= 3 && head[0] == 0xFF && head[1] == 0xD8 && head[2] == 0xFF;
}
bool is_binary_pnm(const Bytes& head) {
  return head.size() >= 3 && head[0] == 'P' && (head[1] == '5' || head[1] == '6') &&
         std::isspace(head[2]) != 0;
}

Result<ImageInfo> inspect_png(ImageFile& file) {
  const Bytes head = file.read(0, kPngHead);
  if (head.size() < kPngHead) return Error{"the PNG is cut short within its header"};
  const Bytes tail = file.read(file.size() - kPngEnd.size(), kPngEnd.size());
  if (!std::equal(kPngEnd.begin(), kPngEnd.end(), tail.begin(), tail.end())) {
    return Error{"the PNG is cut short: it does not end with an IEND chunk"};
  }
  const std::uint32_t width = big_endian(&head[16], 4);
  const std::uint32_t height = big_endian(&head[20], 4);
  constexpr std::uint32_t kLongest = 1U << 20;
  if (width == 0 || height == 0 || width > kLongest || height > kLongest) {
    return Error{fmt::format("the PNG header states {} x {} pixels", width, height)};
  }
  const bool grey = head[25] == 0 || head[25] == 4;  // colour types: grey, grey and alpha
  return ImageInfo{
      {static_cast<int>(width), static_cast<int>(height)}, head[24] == 16 ? 16 : 8, grey ? 1 : 3};
}

/// True where `marker` (second byte) starts a frame header, which holds the size of the picture.
bool is_start_of_frame(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

Result<ImageInfo> inspect_jpeg(ImageFile& file) {
  constexpr std::size_t kPadding = 4096;  // some cameras write zeros behind the picture
  const std::size_t tail_at = file.size() > kPadding ? file.size() - kPadding : 0;
  Bytes tail = file.read(tail_at, kPadding);
  while (!tail.empty() && tail.back() == 0) tail.pop_back();
  if (tail.size() < 2 || tail[tail.size() - 2] != 0xFF || tail.back() != 0xD9) {
    return Error{"the JPEG is cut short: it does not end with an end-of-image marker"};
  }
  for (std::size_t at = 2; at + 4 <= file.size();) {
    const Bytes segment = file.read(at, 10);
    if (segment.size() < 4 || segment[0] != 0xFF) break;
    if (segment[1] == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    if (is_start_of_frame(segment[1]) && segment.size() == 10) {
      const auto height = static_cast<int>(big_endian(&segment[5], 2));
      const auto width = static_cast<int>(big_endian(&segment[7], 2));
      if (width == 0 || height == 0) break;
      return ImageInfo{{width, height}, 8, segment[9] == 1 ? 1 : 3};
    }
    if (segment[1] == 0xDA || segment[1] == 0xD9) break;  // picture data without a frame header
    at += 2 + big_endian(&segment[2], 2);
  }
  return Error{"the JPEG has no frame header"};
}

/// The next number of a PNM header, passing blanks and comments.
std::optional<std::size_t> pnm_number(const Bytes& head, std::size_t& at) {
  while (at < head.size() && (std::isspace(head[at]) != 0 || head[at] == '#')) {
    if (head[at] == '#') {
      while (at < head.size() && head[at] != '\n') ++at;
    } else {
      ++at;
    }
  }
  std::size_t value = 0;
  const std::size_t first = at;
  for (; at < head.size() && std::isdigit(head[at]) != 0 && at - first < 9; ++at) {
    value = 10 * value + static_cast<std::size_t>(head[at] - '0');
  }
  if (at == first) return std::nullopt;
  return value;
}

Result<ImageInfo> inspect_pnm(ImageFile& file) {
  const Bytes head = file.read(0, 4096);
  std::size_t at = 2;
  const auto width = pnm_number(head, at);
  const auto height = width ? pnm_number(head, at) : std::nullopt;
  const auto largest = height ? pnm_number(head, at) : std::nullopt;
  constexpr std::size_t kLongest = std::size_t{1} << 20;
  if (!largest || *width == 0 || *height == 0 || *width > kLongest || *height > kLongest || *largest == 0 ||
      *largest > 65535) {
    return Error{"the PNM header is broken, expected width, height and the largest value"};
  }
  const ImageInfo info{
      {static_cast<int>(*width), static_cast<int>(*height)}, *largest > 255 ? 16 : 8, head[1] == '5' ? 1 : 3};
  const std::size_t needed =
      at + 1 +
      *width * *height * static_cast<std::size_t>(info.channels) * static_cast<std::size_t>(info.bits / 8);
  if (file.size() < needed) {
    return Error{fmt::format("the PNM is cut short: {} bytes, expected {}", file.size(), needed)};
  }
  return info;
}

/// Empty where every chunk is whole. libpng finds the same, but prints to the terminal and carries on.
std::optional<Error> png_defect(const Bytes& bytes) {
  std::size_t at = kPngSignature.size();
  while (at + 12 <= bytes.size()) {
    const std::size_t length = big_endian(&bytes[at], 4);
    if (length > bytes.size() - at - 12) break;
    if (crc32(&bytes[at + 4], length + 4) != big_endian(&bytes[at + 8 + length], 4)) {
      return Error{fmt::format("the PNG is corrupt: wrong checksum in the chunk at byte {}", at)};
    }
    at += 12 + length;
    if (std::memcmp(&bytes[at - 8], "IEND", 4) == 0) return std::nullopt;
  }
  return Error{"the PNG is cut short or corrupt: its chunks do not end with IEND"};
}

Result<cv::Mat> decode(const Bytes& bytes) {
  constexpr std::size_t kShortest = 8;  // fewer bytes hold no header
  if (bytes.size() < kShortest)
    return Error{fmt::format("cannot be decoded: it has only {} bytes", bytes.size())};
  auto image = decode_image(bytes, Pixels::opaque);
  if (!image) return image;
  if (image->depth() != CV_8U && image->depth() != CV_16U && image->depth() != CV_32F) {
    return Error{"has an unknown number type, expected 8 or 16 bit or 32 bit floating point"};
  }
  if (image->channels() != 1 && image->channels() != 3) {
    return Error{fmt::format("has {} channels, expected 1 or 3", image->channels())};
  }
  return image;
}

ImageInfo info_of(const cv::Mat& image) {
  return {image.size(), static_cast<int>(8 * image.elemSize1()), image.channels()};
}

Result<ImageInfo> inspect(ImageFile& file) {
  const Bytes head = file.read(0, 8);
  if (is_png(head)) return inspect_png(file);
  if (is_jpeg(head)) return inspect_jpeg(file);
  if (is_binary_pnm(head)) return inspect_pnm(file);
  const auto image = decode(file.read(0, file.size()));
  if (!image) return image.error();
  return info_of(*image);
}

template <class T>
Result<T> named(const std::string& file, Result<T> result) {
  if (result) return result;
  return Error{fmt::format("{}: {}", file, result.error().message)};
}

Result<cv::Mat> read_whole(ImageFile& file) {
  const Bytes bytes = file.read(0, file.size());
  if (is_png(bytes)) {
    if (const auto defect = png_defect(bytes)) return *defect;
  } else if (is_jpeg(bytes) || is_binary_pnm(bytes)) {
    const auto info = inspect(file);
    if (!info) return info.error();
  }
  return decode(bytes);
}

}  // namespace

Result<ImageInfo> inspect_image(const std::filesystem::path& path) {
  auto file = ImageFile::open(path);
  return named(path.string(), file ? inspect(*file) : file.error());
}

Result<cv::Mat> read_image(const std::filesystem::path& path) {
  auto file = ImageFile::open(path);
  return named(path.string(), file ? read_whole(*file) : file.error());
}

Result<ImageInfo> inspect_image_bytes(std::string_view bytes, const std::string& name) {
  auto file = ImageFile::of(bytes);
  return named(name, file ? inspect(*file) : file.error());
}

Result<cv::Mat> read_image_bytes(std::string_view bytes, const std::string& name) {
  auto file = ImageFile::of(bytes);
  return named(name, file ? read_whole(*file) : file.error());
}

}  // namespace pade::io
