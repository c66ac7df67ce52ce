// What clients of a session can subscribe to.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pade::live {

/// In the order of web_channels.
enum class WebChannel : std::uint8_t {
  camera,
  camera_info,
  obstacles,
  depth_picture,
  depth,
  sigma,
  cloud,
  voxels,
  transforms,
  path,
  sectors,
  health,
};

/// Topic, and type of its messages, which are CDR.
struct WebChannelInfo {
  std::string_view topic;
  std::string_view type;
  bool of_a_frame = false;  ///< a message for each frame, and its images are needed for it
};

inline constexpr std::array<WebChannelInfo, 12> web_channels = {{
    {"/camera/image_raw/compressed", "sensor_msgs/CompressedImage", true},
    {"/camera/camera_info", "sensor_msgs/CameraInfo", true},
    {"/pade/obstacles/compressed", "sensor_msgs/CompressedImage", true},
    {"/pade/depth/compressed", "sensor_msgs/CompressedImage", true},
    {"/pade/depth", "sensor_msgs/Image", true},
    {"/pade/sigma", "sensor_msgs/Image", true},
    {"/pade/cloud", "sensor_msgs/PointCloud2", true},
    {"/occupied_cells_vis_array", "visualization_msgs/MarkerArray", false},
    {"/tf", "tf2_msgs/TFMessage", false},
    {"/pade/path", "nav_msgs/Path", false},
    {"/pade/sectors", "sensor_msgs/LaserScan", false},
    {"/diagnostics", "diagnostic_msgs/DiagnosticArray", false},
}};  ///< of all channels, by their number
inline constexpr std::size_t kWebChannels = web_channels.size();

}  // namespace pade::live
