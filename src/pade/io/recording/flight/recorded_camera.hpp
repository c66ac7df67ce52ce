// The camera that a sensor_msgs/CameraInfo describes.
#pragma once

#include <string_view>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {

/// Whether a topic is that of rectified images: "/left/image_rect_color", and not "/direct/image_corrected".
bool is_rectified(std::string_view topic);

/// Errors: images that are binned, cut, turned or never calibrated, and lenses that are not understood.
/// @param rectified  the images are: P is the camera, and it has no distortion
Result<Camera> camera_of(const CameraInfoMessage& info, bool rectified);

}  // namespace pade::io
