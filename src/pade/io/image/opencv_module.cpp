// The module for image formats other than PNG, JPEG, PGM and PPM: OpenCV's imgcodecs, and with it GDAL,
// OpenEXR and a hundred more libraries, which the program loads when such a file comes. Nothing else links
// them.
#include "pade/io/image/opencv_module.hpp"

#include <exception>

#include <opencv2/imgcodecs.hpp>

namespace pade::io {
namespace {

int opencv_flags(Pixels pixels) {
  switch (pixels) {
    case Pixels::stored:
      break;
    case Pixels::opaque:
      return cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
    case Pixels::grey:
      return cv::IMREAD_GRAYSCALE;
    case Pixels::colour:
      return cv::IMREAD_COLOR;
  }
  return cv::IMREAD_UNCHANGED;
}

cv::Mat decode_by_opencv(ImageBytes bytes, Pixels pixels, std::string& why) {
  try {  // OpenCV throws on sizes that it refuses and on allocation
    const cv::Mat coded(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<std::uint8_t*>(bytes.data()));
    return cv::imdecode(coded, opencv_flags(pixels));
  } catch (const cv::Exception& failure) {
    why = failure.err;
  } catch (const std::exception& failure) {
    why = failure.what();
  }
  return {};
}

std::vector<std::uint8_t> encode_by_opencv(const std::string& ending, const cv::Mat& image,
                                           std::string& why) {
  std::vector<std::uint8_t> bytes;
  try {
    if (!cv::imencode(ending, image, bytes)) bytes.clear();
  } catch (const cv::Exception& failure) {
    why = failure.err;
    bytes.clear();
  } catch (const std::exception& failure) {
    why = failure.what();
    bytes.clear();
  }
  return bytes;
}

bool opencv_encodes(const std::string& ending) {
  try {
    return cv::haveImageWriter("picture" + ending);
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace
}  // namespace pade::io

extern "C" __attribute__((visibility("default"))) const pade::io::OtherFormats* pade_other_image_formats() {
  static const pade::io::OtherFormats kFormats = {.decode = pade::io::decode_by_opencv,
                                                  .encode = pade::io::encode_by_opencv,
                                                  .encodes = pade::io::opencv_encodes};
  return &kFormats;
}
