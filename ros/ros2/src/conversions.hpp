// Messages of ROS 2 as plain values of the bridge, and back.
#pragma once

#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <geometry_msgs/msg/pose_stamped.hpp>
#include <geometry_msgs/msg/transform_stamped.hpp>
#include <geometry_msgs/msg/twist_with_covariance_stamped.hpp>
#include <nav_msgs/msg/occupancy_grid.hpp>
#include <nav_msgs/msg/odometry.hpp>
#include <nav_msgs/msg/path.hpp>
#include <octomap_msgs/msg/octomap.hpp>
#include <rclcpp/time.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/compressed_image.hpp>
#include <sensor_msgs/msg/fluid_pressure.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <sensor_msgs/msg/magnetic_field.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <visualization_msgs/msg/marker_array.hpp>

#include "bridge.hpp"

namespace pade_ros {

/// @{
/// The bytes of images are not copied: the message lives as long as the value.
Image value_of(const std::shared_ptr<const sensor_msgs::msg::Image>& message);
Image value_of(const std::shared_ptr<const sensor_msgs::msg::CompressedImage>& message);
CameraInfo value_of(const sensor_msgs::msg::CameraInfo& message);
PoseMessage value_of(const nav_msgs::msg::Odometry& message);
PoseMessage value_of(const geometry_msgs::msg::PoseStamped& message);
ImuMessage value_of(const sensor_msgs::msg::Imu& message);
FixMessage value_of(const sensor_msgs::msg::NavSatFix& message);
VelocityMessage value_of(const geometry_msgs::msg::TwistWithCovarianceStamped& message);
FieldMessage value_of(const sensor_msgs::msg::MagneticField& message);
PressureMessage value_of(const sensor_msgs::msg::FluidPressure& message);
Placement value_of(const geometry_msgs::msg::Transform& message);
/// @}

/// @{
/// What a frame gave.
sensor_msgs::msg::PointCloud2 cloud_of(const FrameResult& result);
/// 32FC1. @param values  rows one behind the other
sensor_msgs::msg::Image image_of(const FrameResult& result, const float* values);
nav_msgs::msg::Path path_of(const FrameResult& result);
/// Of the vehicle, and of the map's own frame where it has one.
/// @param with_body  that of the vehicle too
std::vector<geometry_msgs::msg::TransformStamped> transforms_of(const FrameResult& result, bool with_body);
/// @}

/// @{
/// The map.
octomap_msgs::msg::Octomap octomap_of(const MapResult& result, bool binary);
visualization_msgs::msg::MarkerArray markers_of(const MapResult& result);
sensor_msgs::msg::PointCloud2 centres_of(const MapResult& result);
nav_msgs::msg::OccupancyGrid grid_of(const MapResult& result);
/// @}

/// @param node  name of the node, before that of each part; `now` is the time
diagnostic_msgs::msg::DiagnosticArray diagnostics_of(const std::vector<Diagnosis>& all,
                                                     const std::string& node, Stamp now);

}  // namespace pade_ros
