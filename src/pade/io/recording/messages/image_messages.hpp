// Images and calibrations as ROS has them, and what they are in this project.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"

namespace pade::io {

/// std_msgs/Header.
struct MessageHeader {
  Time stamp;         ///< when it was measured
  std::string frame;  ///< coordinate frame
};
/// sensor_msgs/Image.
struct ImageMessage {
  MessageHeader header;      ///< start of the exposure, and the camera's frame
  std::uint32_t height = 0;  ///< pixels
  std::uint32_t width = 0;   ///< pixels
  std::string encoding;      ///< "mono8", "bgr8", ... (sensor_msgs/image_encodings)
  bool big_endian = false;   ///< of pixels of 16 bits
  std::uint32_t step = 0;    ///< bytes of a row
  std::string_view data;     ///< in bytes that must outlive it
};
/// sensor_msgs/CompressedImage.
struct CompressedImageMessage {
  MessageHeader header;   ///< as that of ImageMessage
  std::string format;     ///< "jpeg", or as image_transport has it: "bayer_rggb8; jpeg compressed bgr8"
  std::string_view data;  ///< a file (PNG, JPEG), in bytes that must outlive it
};
/// sensor_msgs/CameraInfo.
struct CameraInfoMessage {
  MessageHeader header;         ///< the camera's frame
  std::uint32_t height = 0;     ///< pixels
  std::uint32_t width = 0;      ///< pixels
  std::string model;            ///< "plumb_bob", "rational_polynomial", "equidistant", "none"
  std::vector<double> d;        ///< distortion coefficients, in the order of the model
  std::array<double, 9> k{};    ///< intrinsics, row by row, pixels
  std::array<double, 9> r{};    ///< rotation of rectified images
  std::array<double, 12> p{};   ///< projection of rectified images, row by row
  std::uint32_t binning_x = 0;  ///< 0 and 1: none
  std::uint32_t binning_y = 0;  ///< 0 and 1: none
  std::uint32_t x_offset = 0;   ///< of the region of interest, pixels
  std::uint32_t y_offset = 0;   ///< of the region of interest, pixels
};

/// The pixels of a message: 8 or 16 bit, grey or BGR. Error for an encoding that is not understood, or fewer
/// bytes than its rows need.
Result<cv::Mat> pixels_of(const ImageMessage& image);
/// The same of a compressed one. Error for what is neither PNG nor JPEG, or damaged.
Result<cv::Mat> pixels_of(const CompressedImageMessage& image);

/// Whether a topic is that of rectified images, by a whole word of its name: "/left/image_rect_color", and
/// not
/// "/direct/image_corrected".
bool is_rectified(std::string_view topic);

/// The camera of a calibration, with its lens.
/// @param info  calibration of the images as they are
/// @param rectified  the images are those after rectification: P is their camera, and there is no lens.
/// Error where the calibration does not hold for whole images, turns them, or was never made.
Result<Camera> camera_of(const CameraInfoMessage& info, bool rectified);

}  // namespace pade::io
