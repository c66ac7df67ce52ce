// A camera of the kernel's video interface (V4L2), read through buffers that are shared with the driver.
#pragma once

#include <memory>
#include <string>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// Opens a device in the size of its calibration, in the first of GREY, YUYV and MJPEG that it has. Stamps
/// are the driver's, of the monotonic clock; where it stamps the end of a frame, that is taken for its start.
/// Frames marked as faulty, of a wrong size, that cannot be decoded, without a stamp or with one of another
/// clock are left out. A device that was pulled out, errs or gives nothing for a second is opened again twice
/// a second. Errors: no such device, in use, or it has no such size or format.
/// @param camera  as calibrated, with its distortion; images are undistorted
/// @param rate    frames per second that it is asked for
Result<std::unique_ptr<FrameSource>> open_v4l2(const std::string& device, const Camera& camera, double rate);

}  // namespace pade::live
