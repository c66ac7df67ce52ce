#include "calibration.hpp"

#include <string_view>

#include <fmt/format.h>
#include <pade/io/recording/messages/image_messages.hpp>

namespace pade_ros {

bool is_same_lens(const CameraInfo& a, const CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.model == b.model && a.d == b.d && a.k == b.k &&
         a.r == b.r && a.p == b.p && a.binning_x == b.binning_x && a.binning_y == b.binning_y &&
         a.x_offset == b.x_offset && a.y_offset == b.y_offset;
}

pade::Result<std::shared_ptr<const Eye>> eye_of(const CameraInfo& message, bool rectified) {
  pade::io::CameraInfoMessage info;
  info.width = message.width;
  info.height = message.height;
  info.model = message.model;
  info.d = message.d;
  info.k = message.k;
  info.r = message.r;
  info.p = message.p;
  info.binning_x = message.binning_x;
  info.binning_y = message.binning_y;
  info.x_offset = message.x_offset;
  info.y_offset = message.y_offset;
  const auto camera = pade::io::camera_of(info, rectified);
  if (!camera) return camera.error();
  if (camera->width <= 0 || camera->height <= 0)
    return pade::Error{fmt::format("it is for {} x {} pixels", message.width, message.height)};
  return std::make_shared<const Eye>(Eye{*camera, pade::Undistorter(*camera)});
}

pade::Result<cv::Mat> undistorted(const Image& message, const Eye& eye) {
  const std::string_view bytes(reinterpret_cast<const char*>(message.data), message.size);
  pade::Result<cv::Mat> pixels = pade::Error{};
  if (message.compressed) {
    pade::io::CompressedImageMessage image;
    image.format = message.encoding;
    image.data = bytes;
    pixels = pade::io::pixels_of(image);
  } else {
    pade::io::ImageMessage image;
    image.height = message.height;
    image.width = message.width;
    image.encoding = message.encoding;
    image.big_endian = message.big_endian;
    image.step = message.step;
    image.data = bytes;
    pixels = pade::io::pixels_of(image);
  }
  if (!pixels) return pade::Error{fmt::format("the image is unusable: {}", pixels.error().message)};
  if (pixels->depth() != CV_8U)
    return pade::Error{
        fmt::format("the image is unusable: found {} bits, expected 8", 8 * pixels->elemSize1())};
  if (pixels->size() != eye.lens.size())
    return pade::Error{fmt::format("the images have {} x {} pixels, and camera_info is for {} x {}",
                                   pixels->cols, pixels->rows, eye.lens.width, eye.lens.height)};
  return eye.undistort(*pixels);
}

}  // namespace pade_ros
