// Image files of every kind that their formats know, written by libpng and libjpeg themselves or byte by
// byte, so that our readers are not held to our writers.
#pragma once

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <jpeglib.h>
#include <opencv2/imgproc.hpp>
#include <png.h>

namespace pade::test {

using FileBytes = std::vector<std::uint8_t>;

struct PictureFile {
  std::string name;
  FileBytes bytes;
};

/// Smooth, with some noise, so that compression has something to do.
inline cv::Mat picture(int width, int height, int channels) {
  cv::Mat image(height, width, CV_8UC(channels));
  cv::RNG(7).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {5, 5}, 1.5);
  return image;
}

/// TIFF as in EXIF, with one tag: the orientation.
inline FileBytes orientation_tags(int orientation, bool little) {
  FileBytes tags = {'I', 'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 0x01, 3, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  tags[18] = static_cast<std::uint8_t>(orientation);
  if (!little) {
    tags = {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1, 0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0};
    tags[19] = static_cast<std::uint8_t>(orientation);
  }
  return tags;
}

struct PngKind {
  const char* name;
  int colour_type, bits;
  bool interlaced = false, transparent = false, gamma = false;
  int orientation = 0;  ///< 0: no tags
  bool tags_behind = false;
};

/// Rows are noise: any bytes are pixels, but a palette needs indices that it has.
inline FileBytes png_file(const PngKind& kind, int width, int height) {
  FileBytes bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp out, png_bytep from, std::size_t count) {
        auto& to = *static_cast<FileBytes*>(png_get_io_ptr(out));
        to.insert(to.end(), from, from + count);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), kind.bits,
               kind.colour_type, kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  cv::RNG random(11);
  if (kind.colour_type == PNG_COLOR_TYPE_PALETTE) {
    std::vector<png_color> palette(1U << static_cast<unsigned>(kind.bits));
    for (png_color& c : palette)
      c = {static_cast<png_byte>(random.uniform(0, 256)), static_cast<png_byte>(random.uniform(0, 256)),
           static_cast<png_byte>(random.uniform(0, 256))};
    png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  }
  if (kind.transparent) {
    png_byte shades[2] = {10, 200};
    png_color_16 one{};
    one.gray = 1;
    one.red = one.green = one.blue = 7;
    if (kind.colour_type == PNG_COLOR_TYPE_PALETTE)
      png_set_tRNS(png, info, shades, 2, nullptr);
    else
      png_set_tRNS(png, info, nullptr, 1, &one);
  }
  if (kind.gamma) png_set_gAMA(png, info, 0.45);
  FileBytes tags = orientation_tags(kind.orientation, true);
  if (kind.orientation > 0 && !kind.tags_behind)
    png_set_eXIf_1(png, info, static_cast<png_uint_32>(tags.size()), tags.data());
  png_write_info(png, info);
  const std::size_t stride = png_get_rowbytes(png, info);
  std::vector<FileBytes> rows(static_cast<std::size_t>(height), FileBytes(stride));
  std::vector<png_bytep> starts;
  for (FileBytes& row : rows) {
    for (std::uint8_t& byte : row) byte = static_cast<std::uint8_t>(random.uniform(0, 256) & 0xEE);
    starts.push_back(row.data());
  }
  png_write_image(png, starts.data());
  if (kind.orientation > 0 && kind.tags_behind)
    png_set_eXIf_1(png, info, static_cast<png_uint_32>(tags.size()), tags.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

inline std::vector<PictureFile> png_files(int width, int height) {
  const int kGrey = PNG_COLOR_TYPE_GRAY, kGreyAlpha = PNG_COLOR_TYPE_GRAY_ALPHA, kRgb = PNG_COLOR_TYPE_RGB,
            kRgba = PNG_COLOR_TYPE_RGB_ALPHA, kPalette = PNG_COLOR_TYPE_PALETTE;
  std::vector<PictureFile> files;
  for (const PngKind& kind : std::vector<PngKind>{
           {"grey1", kGrey, 1},
           {"grey2", kGrey, 2},
           {"grey4", kGrey, 4},
           {"grey8", kGrey, 8},
           {"grey16", kGrey, 16},
           {"greyalpha8", kGreyAlpha, 8},
           {"greyalpha16", kGreyAlpha, 16},
           {"rgb8", kRgb, 8},
           {"rgb16", kRgb, 16},
           {"rgba8", kRgba, 8},
           {"rgba16", kRgba, 16},
           {"palette1", kPalette, 1},
           {"palette2", kPalette, 2},
           {"palette4", kPalette, 4},
           {"palette8", kPalette, 8},
           {"palette8transparent", kPalette, 8, false, true},
           {"palette2transparent", kPalette, 2, false, true},
           {"grey8transparent", kGrey, 8, false, true},
           {"grey2transparent", kGrey, 2, false, true},
           {"rgb8transparent", kRgb, 8, false, true},
           {"rgb16transparent", kRgb, 16, false, true},
           {"rgb8interlaced", kRgb, 8, true},
           {"grey2interlaced", kGrey, 2, true},
           {"rgba16interlaced", kRgba, 16, true},
           {"palette4interlaced", kPalette, 4, true},
           {"rgb8gamma", kRgb, 8, false, false, true},
           {"grey16gamma", kGrey, 16, false, false, true},
           {"rgb8turned6", kRgb, 8, false, false, false, 6},
           {"grey8turned3", kGrey, 8, false, false, false, 3},
           {"rgb8turned8behind", kRgb, 8, false, false, false, 8, true},
       })
    files.push_back({fmt::format("{}.png", kind.name), png_file(kind, width, height)});
  return files;
}

using JpegSettings = std::function<void(jpeg_compress_struct&)>;

/// `image` has 1, 3 or 4 channels, which stand for `space`.
inline FileBytes jpeg_file(const cv::Mat& image, J_COLOR_SPACE space, const JpegSettings& settings,
                           const FileBytes& tags = {}) {
  jpeg_compress_struct codec{};
  jpeg_error_mgr errors{};
  codec.err = jpeg_std_error(&errors);
  jpeg_create_compress(&codec);
  unsigned char* out = nullptr;
  unsigned long count = 0;
  jpeg_mem_dest(&codec, &out, &count);
  codec.image_width = static_cast<JDIMENSION>(image.cols);
  codec.image_height = static_cast<JDIMENSION>(image.rows);
  codec.input_components = image.channels();
  codec.in_color_space = space;
  jpeg_set_defaults(&codec);
  jpeg_set_quality(&codec, 85, TRUE);
  settings(codec);
  jpeg_start_compress(&codec, TRUE);
  if (!tags.empty()) {
    FileBytes segment = {'E', 'x', 'i', 'f', 0, 0};
    segment.insert(segment.end(), tags.begin(), tags.end());
    jpeg_write_marker(&codec, JPEG_APP0 + 1, segment.data(), static_cast<unsigned>(segment.size()));
  }
  for (int y = 0; y < image.rows; ++y) {
    JSAMPROW row = const_cast<JSAMPROW>(image.ptr(y));
    jpeg_write_scanlines(&codec, &row, 1);
  }
  jpeg_finish_compress(&codec);
  jpeg_destroy_compress(&codec);
  FileBytes bytes(out, out + count);
  std::free(out);
  return bytes;
}

/// Without the segments that define Huffman tables, as cameras send it.
inline FileBytes without_tables(const FileBytes& jpeg) {
  FileBytes kept(jpeg.begin(), jpeg.begin() + 2);
  for (std::size_t at = 2; at + 4 < jpeg.size();) {
    const std::size_t length = 2 + (std::size_t{jpeg[at + 2]} << 8U | jpeg[at + 3]);
    const auto first = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    if (jpeg[at + 1] == 0xDA) {
      kept.insert(kept.end(), first, jpeg.end());
      break;
    }
    if (jpeg[at + 1] != 0xC4) kept.insert(kept.end(), first, first + static_cast<std::ptrdiff_t>(length));
    at += length;
  }
  return kept;
}

inline std::vector<PictureFile> jpeg_files(int width, int height) {
  const cv::Mat grey = picture(width, height, 1), colour = picture(width, height, 3),
                four = picture(width, height, 4);
  const JpegSettings plain = [](jpeg_compress_struct&) {};
  const JpegSettings progressive = [](jpeg_compress_struct& codec) { jpeg_simple_progression(&codec); };
  const JpegSettings restarts = [](jpeg_compress_struct& codec) { codec.restart_interval = 2; };
  const JpegSettings arithmetic = [](jpeg_compress_struct& codec) { codec.arith_code = TRUE; };
  const JpegSettings full = [](jpeg_compress_struct& codec) {
    codec.comp_info[0].h_samp_factor = codec.comp_info[0].v_samp_factor = 1;
  };
  const JpegSettings wide = [](jpeg_compress_struct& codec) { codec.comp_info[0].v_samp_factor = 1; };
  const JpegSettings as_rgb = [](jpeg_compress_struct& codec) { jpeg_set_colorspace(&codec, JCS_RGB); };
  const JpegSettings as_ycck = [](jpeg_compress_struct& codec) { jpeg_set_colorspace(&codec, JCS_YCCK); };
  std::vector<PictureFile> files = {
      {"grey.jpg", jpeg_file(grey, JCS_GRAYSCALE, plain)},
      {"colour.jpg", jpeg_file(colour, JCS_RGB, plain)},
      {"full.jpg", jpeg_file(colour, JCS_RGB, full)},
      {"wide.jpg", jpeg_file(colour, JCS_RGB, wide)},
      {"progressive.jpg", jpeg_file(colour, JCS_RGB, progressive)},
      {"progressivegrey.jpg", jpeg_file(grey, JCS_GRAYSCALE, progressive)},
      {"restarts.jpg", jpeg_file(colour, JCS_RGB, restarts)},
      {"arithmetic.jpg", jpeg_file(colour, JCS_RGB, arithmetic)},
      {"rgb.jpg", jpeg_file(colour, JCS_RGB, as_rgb)},
      {"cmyk.jpg", jpeg_file(four, JCS_CMYK, plain)},
      {"ycck.jpg", jpeg_file(four, JCS_CMYK, as_ycck)},
      {"motion.jpg", without_tables(jpeg_file(colour, JCS_RGB, plain))},
      {"notags.jpg", jpeg_file(colour, JCS_RGB, plain, FileBytes(30, 'x'))},
  };
  for (int orientation = 0; orientation <= 9; ++orientation)
    files.push_back({fmt::format("turned{}.jpg", orientation),
                     jpeg_file(colour, JCS_RGB, plain, orientation_tags(orientation, orientation % 2 == 0))});
  return files;
}

inline std::vector<PictureFile> pnm_files(int width, int height) {
  std::vector<PictureFile> files;
  for (const int kind : {5, 6}) {
    for (const int largest : {255, 100, 1, 256, 65535}) {
      for (const char* comment : {"", "# a comment 12\n"}) {
        const std::string head = fmt::format("P{}\n{}{} {}\n{}\n", kind, comment, width, height, largest);
        FileBytes bytes(head.begin(), head.end());
        cv::RNG random(13);
        const int count = width * height * (kind == 6 ? 3 : 1) * (largest > 255 ? 2 : 1);
        for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(random.uniform(0, 256)));
        files.push_back({fmt::format("p{}of{}{}.pnm", kind, largest, *comment == 0 ? "" : "commented"),
                         std::move(bytes)});
      }
    }
  }
  return files;
}

}  // namespace pade::test
