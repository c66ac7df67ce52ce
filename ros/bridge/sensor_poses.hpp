// Poses from our own filter on IMU and GNSS.
#pragma once

#include <memory>

#include "pose_inputs.hpp"

namespace pade_ros {

/// The GPS/INS filter on sensor_msgs/Imu, NavSatFix and what else there is. The body is the IMU's frame, the
/// world east, north, up of the first fix.
std::unique_ptr<PoseInput> make_sensor_poses(const NodeOptions& options, const Topics& topics,
                                             Transforms& transforms);

}  // namespace pade_ros
