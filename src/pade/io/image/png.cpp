// PNG by libpng.
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <exception>

#include <fmt/format.h>
#include <png.h>

#include "pade/io/image/decoding.hpp"
#include "pade/io/image/orientation.hpp"

namespace pade::io {
namespace {

/// libpng's own words about why it gave up.
struct PngComplaint {
  std::array<char, 120> text{};
};

[[noreturn]] void png_gives_up(png_structp png, png_const_charp text) {
  auto& complaint = *static_cast<PngComplaint*>(png_get_error_ptr(png));
  std::snprintf(complaint.text.data(), complaint.text.size(), "%s", text);
  png_longjmp(png, 1);
}

/// Harmless; to the terminal, as libpng would, a camera could say it with each frame.
void png_warns(png_structp /*png*/, png_const_charp /*text*/) {}

/// False where libpng gave up, which leaves `steps` by a jump: they call libpng, and own nothing.
template <class Steps>
bool png_carried_out(png_structp png, const Steps& steps) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  steps();
  return true;
}

class PngFile {
 public:
  explicit PngFile(ImageBytes bytes) : left_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &complaint_, png_gives_up, png_warns);
    if (png_ == nullptr) return;
    head_ = png_create_info_struct(png_);
    tail_ = png_create_info_struct(png_);
  }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;
  ~PngFile() { png_destroy_read_struct(&png_, &head_, &tail_); }

  [[nodiscard]] Error error() const {
    return Error{fmt::format("the PNG cannot be decoded: {}", complaint_.text.data())};
  }

  /// What the header says; false: see error().
  bool read_head() {
    if (png_ == nullptr || head_ == nullptr || tail_ == nullptr) return false;
    return png_carried_out(png_, [&] {
      png_set_read_fn(png_, this, take);
      png_read_info(png_, head_);
      png_get_IHDR(png_, head_, &width_, &height_, &bits_, &colour_type_, nullptr, nullptr, nullptr);
      int shades = 0;
      if (colour_type_ == PNG_COLOR_TYPE_RGB || colour_type_ == PNG_COLOR_TYPE_PALETTE)
        png_get_tRNS(png_, head_, nullptr, &shades, nullptr);
      seen_through_ = shades > 0 || (colour_type_ & PNG_COLOR_MASK_ALPHA) != 0;
    });
  }
  [[nodiscard]] std::uint64_t width() const { return width_; }
  [[nodiscard]] std::uint64_t height() const { return height_; }
  [[nodiscard]] int type() const {
    const int colours = (colour_type_ & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1;
    return CV_MAKETYPE(bits_ == 16 ? CV_16U : CV_8U, seen_through_ ? 4 : colours);
  }

  /// Into rows of 8 or 16 bit and 1, 3 or 4 channels.
  bool read_pixels(cv::Mat& image) {
    std::vector<png_bytep> rows(static_cast<std::size_t>(image.rows));
    for (int y = 0; y < image.rows; ++y) rows[static_cast<std::size_t>(y)] = image.ptr(y);
    return png_carried_out(png_, [&] {
      choose_conversions(image);
      png_read_image(png_, rows.data());
      png_read_end(png_, tail_);
    });
  }

  /// After read_pixels(): the tags may stand behind the pixels.
  int orientation() {
    int found = 1;
    const bool read = png_carried_out(png_, [&] {
      for (const png_infop info : {head_, tail_}) {
        png_uint_32 count = 0;
        png_bytep tags = nullptr;
        if (png_get_eXIf_1(png_, info, &count, &tags) == 0 || count == 0) continue;
        found = exif_orientation({tags, count});
        break;
      }
    });
    return read ? found : 1;
  }

 private:
  static void take(png_structp png, png_bytep to, std::size_t count) {
    ImageBytes& left = static_cast<PngFile*>(png_get_io_ptr(png))->left_;
    if (count > left.size()) png_error(png, "it is cut short");
    std::memcpy(to, left.data(), count);
    left = left.subspan(count);
  }

  /// To the image's bits and channels, as OpenCV asks for them.
  void choose_conversions(const cv::Mat& image) {
    const bool colours = (colour_type_ & PNG_COLOR_MASK_COLOR) != 0;
    if (image.depth() == CV_8U && bits_ == 16)
      png_set_strip_16(png_);
    else
      png_set_swap(png_);
    if (image.channels() < 4)
      png_set_strip_alpha(png_);
    else
      png_set_tRNS_to_alpha(png_);
    if (colour_type_ == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (!colours && bits_ < 8) png_set_expand_gray_1_2_4_to_8(png_);
    if (image.channels() == 1)
      png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    else if (colours)
      png_set_bgr(png_);
    else
      png_set_gray_to_rgb(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, head_);
  }

  PngComplaint complaint_;
  ImageBytes left_;
  png_structp png_ = nullptr;
  png_infop head_ = nullptr, tail_ = nullptr;
  png_uint_32 width_ = 0, height_ = 0;
  int bits_ = 0, colour_type_ = 0;
  bool seen_through_ = false;
};

struct PngOutput {
  std::vector<std::uint8_t> bytes;
  static void put(png_structp png, png_bytep from, std::size_t count) {
    bool kept = true;
    try {
      auto& bytes = static_cast<PngOutput*>(png_get_io_ptr(png))->bytes;
      bytes.insert(bytes.end(), from, from + count);
    } catch (const std::exception&) {
      kept = false;
    }
    if (!kept) png_error(png, "no memory is left");
  }
  static void flush(png_structp) {}
};

}  // namespace

Result<cv::Mat> decode_png(ImageBytes bytes, Pixels pixels) {
  PngFile file(bytes);
  if (!file.read_head()) return file.error();
  if (const Status size = check_image_size(file.width(), file.height(), "PNG"); !size) return size.error();
  cv::Mat image(static_cast<int>(file.height()), static_cast<int>(file.width()),
                wanted_type(file.type(), pixels));
  if (!file.read_pixels(image)) return file.error();
  if (pixels == Pixels::grey || pixels == Pixels::colour) return upright(image, file.orientation());
  return image;
}

std::vector<std::uint8_t> encode_png(const cv::Mat& image, const PngPacking& packing) {
  CV_Assert(!image.empty() && (image.depth() == CV_8U || image.depth() == CV_16U));
  CV_Assert(image.channels() == 1 || image.channels() == 3 || image.channels() == 4);
  std::vector<png_bytep> rows(static_cast<std::size_t>(image.rows));
  for (int y = 0; y < image.rows; ++y)
    rows[static_cast<std::size_t>(y)] = const_cast<png_bytep>(image.ptr(y));
  constexpr std::array kColourTypes = {0, PNG_COLOR_TYPE_GRAY, 0, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGBA};
  const int colour_type = kColourTypes.at(static_cast<std::size_t>(image.channels()));
  constexpr int kStrategyRuns = 3;  // Z_RLE
  PngComplaint complaint;
  PngOutput output;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &complaint, png_gives_up, png_warns);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool written =
      info != nullptr && png_carried_out(png, [&] {
        png_set_write_fn(png, &output, PngOutput::put, PngOutput::flush);
        if (packing.left_filter) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
        png_set_compression_level(png, packing.level);
        png_set_compression_strategy(png, packing.runs_only ? kStrategyRuns : 0);
        png_set_IHDR(png, info, static_cast<png_uint_32>(image.cols), static_cast<png_uint_32>(image.rows),
                     image.depth() == CV_8U ? 8 : 16, colour_type, PNG_INTERLACE_NONE,
                     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_write_info(png, info);
        png_set_bgr(png);
        png_set_swap(png);
        png_write_image(png, rows.data());
        png_write_end(png, info);
      });
  png_destroy_write_struct(&png, &info);
  if (!written) output.bytes.clear();
  return std::move(output.bytes);
}

}  // namespace pade::io
