#include "pade/io/image/image_codec.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <exception>

#include <fmt/format.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/image/decoding.hpp"
#include "pade/io/image/other_formats.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

using DecodeImage = Result<cv::Mat> (*)(ImageBytes, Pixels);

DecodeImage decoder_of(ImageBytes bytes) {
  constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::array<std::uint8_t, 3> kJpeg = {0xFF, 0xD8, 0xFF};
  const auto begins = [bytes](const auto& signature) {
    return bytes.size() >= signature.size() && std::equal(signature.begin(), signature.end(), bytes.begin());
  };
  if (begins(kPng)) return decode_png;
  if (begins(kJpeg)) return decode_jpeg;
  if (bytes.size() >= 3 && bytes[0] == 'P' && (bytes[1] == '5' || bytes[1] == '6') &&
      std::isspace(bytes[2]) != 0)
    return decode_pnm;
  return other_format_of(bytes).empty() ? nullptr : decode_other_format;
}

std::string lower_ending(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

using EncodeImage = std::vector<std::uint8_t> (*)(const cv::Mat&);

/// Null for endings that are not ours.
EncodeImage encoder_of(const std::string& ending) {
  if (ending == ".png") return [](const cv::Mat& image) { return encode_png(image); };
  if (ending == ".jpg" || ending == ".jpeg") return [](const cv::Mat& image) { return encode_jpeg(image); };
  if (ending == ".pgm" || ending == ".ppm") return encode_pnm;
  return nullptr;
}

}  // namespace

Result<cv::Mat> decode_image(ImageBytes bytes, Pixels pixels) {
  const DecodeImage decode = decoder_of(bytes);
  if (decode == nullptr) return Error{"cannot be decoded, expected PNG, JPEG, PGM, PPM, BMP or TIFF"};
  try {  // only cv::Mat and std::vector throw, where memory ends
    return decode(bytes, pixels);
  } catch (const std::exception& failure) {
    return Error{fmt::format("cannot be decoded: {}", failure.what())};
  }
}

Result<cv::Mat> load_image(const std::filesystem::path& file, Pixels pixels) {
  const auto bytes = read_file(file);
  if (!bytes) return bytes.error();
  auto image = decode_image(image_bytes(*bytes), pixels);
  if (!image) return Error{fmt::format("{}: {}", file.string(), image.error().message)};
  return image;
}

Status check_image_name(const std::filesystem::path& file) {
  const std::string ending = lower_ending(file);
  return encoder_of(ending) != nullptr ? Status() : check_other_ending(ending);
}

Status save_image(const std::filesystem::path& file, const cv::Mat& image) {
  const std::string ending = lower_ending(file);
  const EncodeImage encode = encoder_of(ending);
  const auto bytes = encode != nullptr ? Result(encode(image)) : encode_other_format(ending, image);
  if (!bytes) return Error{fmt::format("{}: {}", file.string(), bytes.error().message)};
  if (bytes->empty())
    return Error{fmt::format("{}: the image cannot be written as {}", file.string(), ending)};
  return write_file(file, {reinterpret_cast<const char*>(bytes->data()), bytes->size()}, Overwrite::replace);
}

}  // namespace pade::io
