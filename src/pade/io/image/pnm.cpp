// Binary PGM and PPM (netpbm's formats 5 and 6), 8 bit, or 16 in the order of the network.
#include <cctype>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/io/image/decoding.hpp"

namespace pade::io {
namespace {

constexpr std::size_t kLongestHead = 1U << 16U;  // with comments

struct PnmHead {
  std::uint64_t width = 0, height = 0, largest = 0;
  std::size_t pixels_at = 0;
};

/// The next number, behind blanks and comments; `at` is then behind the one byte that ends it.
std::optional<std::uint64_t> pnm_number(ImageBytes head, std::size_t& at) {
  constexpr std::uint64_t kMost = 1'000'000'000;
  bool comment = false;
  while (at < head.size() && (comment || std::isdigit(head[at]) == 0)) {
    if (comment || head[at] == '#')
      comment = head[at] != '\n' && head[at] != '\r';
    else if (std::isspace(head[at]) == 0)
      return std::nullopt;
    ++at;
  }
  if (at == head.size()) return std::nullopt;
  std::uint64_t value = 0;
  for (; at < head.size() && std::isdigit(head[at]) != 0; ++at) {
    value = value * 10 + static_cast<std::uint64_t>(head[at] - '0');
    if (value > kMost) return std::nullopt;
  }
  if (at == head.size()) return std::nullopt;
  ++at;
  return value;
}

std::optional<PnmHead> pnm_head(ImageBytes bytes) {
  const ImageBytes text = bytes.first(std::min(bytes.size(), kLongestHead));
  PnmHead head;
  head.pixels_at = 2;
  for (std::uint64_t* const number : {&head.width, &head.height, &head.largest}) {
    const auto value = pnm_number(text, head.pixels_at);
    if (!value) return std::nullopt;
    *number = *value;
  }
  return head;
}

/// One row of channels in the machine's order; 8 bits of 16 where only they are wanted.
template <class Stored, class Wanted>
void read_samples(const std::uint8_t* from, Wanted* to, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i, from += sizeof(Stored)) {
    if constexpr (sizeof(Stored) == 1)
      to[i] = *from;
    else if constexpr (sizeof(Wanted) == 1)
      to[i] = from[0];
    else
      to[i] = static_cast<Wanted>(from[0] << 8U | from[1]);
  }
}

/// From `from` channels (RGB) to `to` (BGR).
template <class T>
void arrange(const T* in, int from, T* out, int to, int width) {
  for (int x = 0; x < width; ++x, in += from, out += to) {
    if (from == 1) {
      for (int c = 0; c < to; ++c) out[c] = in[0];
    } else if (to == 3) {
      for (int c = 0; c < 3; ++c) out[c] = in[2 - c];
    } else {
      out[0] = grey_of(in[0], in[1], in[2]);  // only 8-bit grey is asked for
    }
  }
}

template <class Stored, class Wanted>
void read_rows(const std::uint8_t* pixels, int channels, cv::Mat& image) {
  const std::size_t samples = static_cast<std::size_t>(image.cols) * static_cast<std::size_t>(channels);
  std::vector<Wanted> row(samples);
  for (int y = 0; y < image.rows; ++y, pixels += samples * sizeof(Stored)) {
    read_samples<Stored>(pixels, row.data(), samples);
    arrange(row.data(), channels, image.ptr<Wanted>(y), image.channels(), image.cols);
  }
}

}  // namespace

Result<cv::Mat> decode_pnm(ImageBytes bytes, Pixels pixels) {
  const auto head = pnm_head(bytes);
  if (!head || head->largest == 0 || head->largest > 65535)
    return Error{"the PNM header is broken, expected width, height and the largest value"};
  if (const Status size = check_image_size(head->width, head->height, "PNM"); !size) return size.error();
  const bool deep = head->largest > 255;
  const int channels = bytes[1] == '5' ? 1 : 3;
  const std::uint64_t needed =
      head->pixels_at + head->width * head->height * static_cast<std::uint64_t>(channels) * (deep ? 2U : 1U);
  if (bytes.size() < needed)
    return Error{fmt::format("the PNM is cut short: {} bytes, expected {}", bytes.size(), needed)};
  cv::Mat image(static_cast<int>(head->height), static_cast<int>(head->width),
                wanted_type(CV_MAKETYPE(deep ? CV_16U : CV_8U, channels), pixels));
  const std::uint8_t* const first = bytes.data() + head->pixels_at;
  if (!deep)
    read_rows<std::uint8_t, std::uint8_t>(first, channels, image);
  else if (image.depth() == CV_8U)
    read_rows<std::uint16_t, std::uint8_t>(first, channels, image);
  else
    read_rows<std::uint16_t, std::uint16_t>(first, channels, image);
  return image;
}

std::vector<std::uint8_t> encode_pnm(const cv::Mat& image) {
  CV_Assert(!image.empty() && (image.depth() == CV_8U || image.depth() == CV_16U));
  CV_Assert(image.channels() == 1 || image.channels() == 3);
  const int channels = image.channels();
  const bool deep = image.depth() == CV_16U;
  const std::string head =
      fmt::format("P{}\n{} {}\n{}\n", channels == 1 ? 5 : 6, image.cols, image.rows, deep ? 65535 : 255);
  std::vector<std::uint8_t> bytes(head.begin(), head.end());
  bytes.reserve(bytes.size() + image.total() * image.elemSize());
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      for (int c = 0; c < channels; ++c) {
        const int at = x * channels + channels - 1 - c;
        const int value = deep ? image.ptr<std::uint16_t>(y)[at] : image.ptr<std::uint8_t>(y)[at];
        if (deep) bytes.push_back(static_cast<std::uint8_t>(value >> 8));
        bytes.push_back(static_cast<std::uint8_t>(value));
      }
    }
  }
  return bytes;
}

}  // namespace pade::io
