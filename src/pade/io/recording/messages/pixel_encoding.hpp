// How pixels lie in the messages of ROS.
#pragma once

#include <string_view>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"
#include "pade/io/recording/messages/image_messages.hpp"
#include "pade/io/sequence/image_store.hpp"

namespace pade::io {

/// An encoding of sensor_msgs/Image.
struct PixelEncoding {
  std::string_view name;
  int type;        ///< of the bytes, as OpenCV has them
  int conversion;  ///< to grey or BGR; -1: none
};

/// Null for one that is not understood.
const PixelEncoding* pixel_encoding(std::string_view name);
/// What an image is, without its pixels. Error for an encoding that is not understood.
Result<ImageInfo> info_of(const ImageMessage& image);
/// For what a grey picture in a CompressedImage stands: a mosaic of colours. Null if it is what it looks
/// like. Error for a mosaic that is not understood.
/// @param file  the picture; `name` stands in messages
Result<const PixelEncoding*> mosaic_in(std::string_view format, std::string_view file,
                                       const std::string& name);
/// The pixels of a picture in a CompressedImage.
Result<cv::Mat> pixels_of_file(std::string_view file, const PixelEncoding* mosaic, const std::string& name);

}  // namespace pade::io
