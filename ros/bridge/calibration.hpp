// What a camera sees: its calibration, and its images as the mapper takes them.
#pragma once

#include <memory>

#include <opencv2/core.hpp>
#include <pade/pade.hpp>

#include "bridge.hpp"

namespace pade_ros {

/// The calibration, and what was made of it.
struct Eye {
  pade::Camera lens;
  pade::Undistorter undistort;
};

/// Whether two messages say the same of the lens.
bool is_same_lens(const CameraInfo& a, const CameraInfo& b);

/// Errors: what of the message cannot be used.
/// @param rectified  P of the message is the camera
pade::Result<std::shared_ptr<const Eye>> eye_of(const CameraInfo& message, bool rectified);

/// The undistorted image, 8 bits. Errors: why it cannot be used.
pade::Result<cv::Mat> undistorted(const Image& message, const Eye& eye);

}  // namespace pade_ros
