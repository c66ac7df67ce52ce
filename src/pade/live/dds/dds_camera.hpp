// A camera whose images come over DDS: sensor_msgs/Image, CompressedImage.
#pragma once

#include <memory>
#include <string>

#include "pade/core/camera.hpp"
#include "pade/core/result.hpp"
#include "pade/live/dds/dds_shared.hpp"
#include "pade/live/dds/network.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// The lens that a topic of sensor_msgs/CameraInfo tells, waited for at most so long, s. Errors: none came,
/// or one that cannot be used.
/// @param images  topic of the images: whether they are rectified is in its name
Result<Camera> await_camera_info(DdsNetwork& network, const std::string& topic, const std::string& images,
                                 double patience);

/// The images of a topic; one whose name ends in /compressed carries CompressedImage. Those that cannot be
/// used (an encoding that is not known, another size than the lens, a stamp of another clock) are left out,
/// counted, and said by remark().
/// @param network  and `shared` must outlive the source, which sets there the camera's frame, and why there
///                 is no image
/// @param camera   as it is, with its distortion
Result<std::unique_ptr<FrameSource>> open_dds_camera(DdsNetwork& network, DdsShared& shared,
                                                     const std::string& topic, const Camera& camera);

}  // namespace pade::live
