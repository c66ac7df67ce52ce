// What the topics and frames of our own recordings are called.
#pragma once

namespace pade::io {

/// Names of what is written: topics, and coordinate frames.
namespace flight_names {
inline constexpr const char* image = "/camera/image_raw";
inline constexpr const char* compressed = "/camera/image_raw/compressed";
inline constexpr const char* camera_info = "/camera/camera_info";
inline constexpr const char* odometry = "/odom";
inline constexpr const char* transforms = "/tf_static";
inline constexpr const char* imu = "/imu/data";
inline constexpr const char* fix = "/gps/fix";
inline constexpr const char* velocity = "/gps/fix_velocity";
inline constexpr const char* pressure = "/pressure";
inline constexpr const char* field = "/imu/mag";
/// @{
/// Of a live session: each pose with the covariance of the motion since the frame before, and the mask.
inline constexpr const char* motion = "/pade/motion";
inline constexpr const char* mask = "/pade/mask";
/// @}
inline constexpr const char* world_frame = "map";
inline constexpr const char* body_frame = "base_link";
inline constexpr const char* imu_frame = "imu_link";  // where it is not the body
inline constexpr const char* camera_frame = "camera";
}  // namespace flight_names

}  // namespace pade::io
