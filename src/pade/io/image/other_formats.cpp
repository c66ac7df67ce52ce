#include "pade/io/image/other_formats.hpp"

#include <array>
#include <cctype>
#include <climits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "pade/io/image/opencv_module.hpp"
#include "pade/io/loaded_module.hpp"

namespace pade::io {
namespace {

struct Signature {
  std::size_t at;
  std::string_view bytes;
  std::string_view format;
};

/// Those of the readers in OpenCV 4.6.
using namespace std::string_view_literals;
constexpr std::array kSignatures = {
    Signature{0, "BM"sv, "BMP"},
    Signature{0, "II\x2A\0"sv, "TIFF"},
    Signature{0, "MM\0\x2A"sv, "TIFF"},
    Signature{0, "II\x2B\0"sv, "TIFF"},
    Signature{0, "MM\0\x2B"sv, "TIFF"},
    Signature{8, "WEBP"sv, "WebP"},
    Signature{0, "\0\0\0\x0CjP  \r\n\x87\n"sv, "JPEG 2000"},
    Signature{0, "\xFF\x4F\xFF\x51"sv, "JPEG 2000"},
    Signature{0, "\x76\x2F\x31\x01"sv, "OpenEXR"},
    Signature{0, "#?RADIANCE"sv, "Radiance HDR"},
    Signature{0, "#?RGBE"sv, "Radiance HDR"},
    Signature{0, "\x59\xA6\x6A\x95"sv, "Sun raster"},
    Signature{0, "Pf"sv, "PFM"},
    Signature{0, "PF"sv, "PFM"},
    Signature{0, "P7\n"sv, "PAM"},
    Signature{0, "P1"sv, "PBM"},
    Signature{0, "P2"sv, "PGM of text"},
    Signature{0, "P3"sv, "PPM of text"},
    Signature{0, "P4"sv, "PBM"},
    Signature{128, "DICM"sv, "DICOM"},
    Signature{0, "NITF"sv, "NITF"},
    Signature{140, "DTED"sv, "DTED"},
};

const Result<const OtherFormats*>& other_formats_module() {
  static const Result<const OtherFormats*> kLoaded = load_module<OtherFormats>(
      {"libpade_image_formats.so", other_formats_symbol, "PADE's module for it",
       "the package pade-image-formats, or libopencv-imgcodecs-dev where PADE is built"});
  return kLoaded;
}

std::string because(const std::string& why) { return why.empty() ? std::string() : fmt::format(": {}", why); }

}  // namespace

std::string_view other_format_of(ImageBytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const Signature& signature : kSignatures) {
    if (text.size() < signature.at || !text.substr(signature.at).starts_with(signature.bytes)) continue;
    const bool netpbm = signature.bytes[0] == 'P';  // has a blank behind its two letters
    if (!netpbm || (text.size() > 2 && std::isspace(static_cast<unsigned char>(text[2])) != 0))
      return signature.format;
  }
  return {};
}

Result<cv::Mat> decode_other_format(ImageBytes bytes, Pixels pixels) {
  const std::string_view format = other_format_of(bytes);
  if (bytes.size() > INT_MAX) return Error{fmt::format("the {} image is larger than 2 GiB", format)};
  const auto& module = other_formats_module();
  if (!module) return Error{fmt::format("it is a {} image; {}", format, module.error().message)};
  std::string why;
  cv::Mat image = (*module)->decode(bytes, pixels, why);
  if (image.empty()) return Error{fmt::format("the {} image cannot be decoded{}", format, because(why))};
  return image;
}

Result<std::vector<std::uint8_t>> encode_other_format(const std::string& ending, const cv::Mat& image) {
  if (const Status known = check_other_ending(ending); !known) return known.error();
  std::string why;
  auto bytes = (*other_formats_module())->encode(ending, image, why);
  if (bytes.empty()) return Error{fmt::format("cannot be written as {}{}", ending, because(why))};
  return bytes;
}

Status check_other_ending(const std::string& ending) {
  constexpr std::string_view kOurs = "expected .png, .jpg, .pgm or .ppm";
  if (ending.size() < 2) return Error{fmt::format("found a name without an ending, {}", kOurs)};
  const auto& module = other_formats_module();
  if (!module) return Error{fmt::format("found {}, {}: {}", ending, kOurs, module.error().message)};
  if (!(*module)->encodes(ending)) return Error{fmt::format("found {}, {}", ending, kOurs)};
  return {};
}

}  // namespace pade::io
