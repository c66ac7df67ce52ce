// JPEG by libjpeg (libjpeg-turbo, which knows pixels in the order BGR).
#include <array>
#include <csetjmp>
#include <cstdio>  // jpeglib.h takes it for granted
#include <cstdlib>

#include <fmt/format.h>
#include <jpeglib.h>
// behind it
#include <jerror.h>

#include "pade/io/image/decoding.hpp"
#include "pade/io/image/orientation.hpp"

namespace pade::io {
namespace {

/// What libjpeg says, and where it jumps to when it gives up. The first member is what libjpeg knows of it.
struct JpegTalk {
  jpeg_error_mgr manager{};
  std::jmp_buf back{};
  std::array<char, JMSG_LENGTH_MAX> text{};  ///< of what made the picture useless
  bool corrupt = false;                      ///< parts of the picture are made up
  bool ended = false;                        ///< the bytes ended before the end-of-image marker

  JpegTalk() {
    jpeg_std_error(&manager);
    manager.error_exit = give_up;
    manager.emit_message = note;
  }
  static JpegTalk& of(j_common_ptr codec) { return *reinterpret_cast<JpegTalk*>(codec->err); }

 private:
  [[noreturn]] static void give_up(j_common_ptr codec) {
    JpegTalk& talk = of(codec);
    talk.manager.format_message(codec, talk.text.data());
    std::longjmp(talk.back, 1);
  }
  static void note(j_common_ptr codec, int level) {
    JpegTalk& talk = of(codec);
    switch (level < 0 ? talk.manager.msg_code : 0) {
      case JWRN_JPEG_EOF:
        talk.ended = true;
        break;
      case JWRN_HIT_MARKER:
      case JWRN_HUFF_BAD_CODE:
      case JWRN_ARITH_BAD_CODE:
      case JWRN_MUST_RESYNC:
        if (!talk.corrupt) talk.manager.format_message(codec, talk.text.data());
        talk.corrupt = true;
        break;
      default:  // harmless; to the terminal, as libjpeg would, a camera could say it with each frame
        break;
    }
  }
};

/// False where libjpeg gave up, which leaves `steps` by a jump: they call libjpeg, and own nothing.
template <class Steps>
bool jpeg_carried_out(JpegTalk& talk, const Steps& steps) {
  if (setjmp(talk.back) != 0) return false;
  steps();
  return true;
}

/// A row of inverted CMYK, as Adobe writes it, to BGR or grey, as OpenCV does.
void convert_cmyk(const std::uint8_t* cmyk, std::uint8_t* to, int width, bool colour) {
  for (int x = 0; x < width; ++x, cmyk += 4) {
    const int k = cmyk[3];
    const int red = k - ((255 - cmyk[0]) * k >> 8);
    const int green = k - ((255 - cmyk[1]) * k >> 8);
    const int blue = k - ((255 - cmyk[2]) * k >> 8);
    if (!colour) {
      *to++ = grey_of(red, green, blue);
      continue;
    }
    for (const int value : {blue, green, red}) *to++ = static_cast<std::uint8_t>(value);
  }
}

class JpegFile {
 public:
  explicit JpegFile(ImageBytes bytes) : bytes_(bytes) { codec_.err = &talk_.manager; }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;
  ~JpegFile() { jpeg_destroy_decompress(&codec_); }

  [[nodiscard]] Error error() const {
    return Error{fmt::format("the JPEG cannot be decoded: {}", talk_.text.data())};
  }

  /// What the header says; false: see error().
  bool read_head() {
    return jpeg_carried_out(talk_, [&] {
      jpeg_create_decompress(&codec_);
      jpeg_mem_src(&codec_, bytes_.data(), static_cast<unsigned long>(bytes_.size()));
      jpeg_save_markers(&codec_, kTags, 0xFFFF);
      jpeg_read_header(&codec_, TRUE);
      jpeg_calc_output_dimensions(&codec_);
    });
  }
  [[nodiscard]] std::uint64_t width() const { return codec_.output_width; }
  [[nodiscard]] std::uint64_t height() const { return codec_.output_height; }
  [[nodiscard]] int type() const { return codec_.num_components > 1 ? CV_8UC3 : CV_8UC1; }

  /// Into CV_8UC1 or CV_8UC3; an error also where a part of the picture is missing.
  Status read_pixels(cv::Mat& image) {
    const bool colour = image.channels() > 1;
    const bool four = codec_.num_components == 4;
    bool may_lack_scans = false;  // a picture in one scan is found corrupt where it breaks off
    std::vector<std::uint8_t> row(four ? static_cast<std::size_t>(image.cols) * 4 : 0);
    const bool read = jpeg_carried_out(talk_, [&] {
      codec_.out_color_space = four ? JCS_CMYK : colour ? JCS_EXT_BGR : JCS_GRAYSCALE;
      may_lack_scans = codec_.arith_code || jpeg_has_multiple_scans(&codec_);
      jpeg_start_decompress(&codec_);
      for (int y = 0; y < image.rows; ++y) {
        JSAMPROW to = four ? row.data() : image.ptr(y);
        jpeg_read_scanlines(&codec_, &to, 1);
        if (four) convert_cmyk(row.data(), image.ptr(y), image.cols, colour);
      }
      jpeg_finish_decompress(&codec_);
    });
    if (!read) return error();
    if (talk_.corrupt) return Error{fmt::format("the JPEG is cut short or corrupt: {}", talk_.text.data())};
    if (talk_.ended && may_lack_scans)
      return Error{"the JPEG is cut short: it does not end with an end-of-image marker"};
    return {};
  }

  /// Of the first segment that may have it; not after read_pixels(), which frees them.
  [[nodiscard]] int orientation() const {
    constexpr std::size_t kName = 6;  // "Exif", 0, 0
    for (jpeg_saved_marker_ptr segment = codec_.marker_list; segment != nullptr; segment = segment->next) {
      if (segment->marker != kTags) continue;
      if (segment->data_length <= kName) break;
      return exif_orientation({segment->data + kName, segment->data_length - kName});
    }
    return 1;
  }

 private:
  static constexpr int kTags = JPEG_APP0 + 1;
  ImageBytes bytes_;
  JpegTalk talk_;
  jpeg_decompress_struct codec_{};
};

/// What libjpeg allocated.
struct JpegOutput {
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  JpegOutput() = default;
  JpegOutput(const JpegOutput&) = delete;
  JpegOutput& operator=(const JpegOutput&) = delete;
  ~JpegOutput() { std::free(bytes); }
};

}  // namespace

Result<cv::Mat> decode_jpeg(ImageBytes bytes, Pixels pixels) {
  JpegFile file(bytes);
  if (!file.read_head()) return file.error();
  if (const Status size = check_image_size(file.width(), file.height(), "JPEG"); !size) return size.error();
  cv::Mat image(static_cast<int>(file.height()), static_cast<int>(file.width()),
                wanted_type(file.type(), pixels));
  const int orientation = file.orientation();
  if (const Status read = file.read_pixels(image); !read) return read.error();
  if (pixels == Pixels::grey || pixels == Pixels::colour) return upright(image, orientation);
  return image;
}

std::vector<std::uint8_t> encode_jpeg(const cv::Mat& picture, int quality) {
  CV_Assert(!picture.empty() && (picture.channels() == 1 || picture.channels() == 3));
  cv::Mat image = picture;
  if (picture.depth() != CV_8U) picture.convertTo(image, CV_8U);
  JpegTalk talk;
  JpegOutput output;
  jpeg_compress_struct codec{};
  codec.err = &talk.manager;
  const bool written = jpeg_carried_out(talk, [&] {
    jpeg_create_compress(&codec);
    jpeg_mem_dest(&codec, &output.bytes, &output.count);
    codec.image_width = static_cast<JDIMENSION>(image.cols);
    codec.image_height = static_cast<JDIMENSION>(image.rows);
    codec.input_components = image.channels();
    codec.in_color_space = image.channels() > 1 ? JCS_EXT_BGR : JCS_GRAYSCALE;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, quality, TRUE);
    jpeg_start_compress(&codec, TRUE);
    for (int y = 0; y < image.rows; ++y) {
      JSAMPROW row = const_cast<JSAMPROW>(image.ptr(y));
      jpeg_write_scanlines(&codec, &row, 1);
    }
    jpeg_finish_compress(&codec);
  });
  jpeg_destroy_compress(&codec);
  if (!written) return {};
  return {output.bytes, output.bytes + output.count};
}

}  // namespace pade::io
