// Messages of ROS 1 as plain values of the bridge, and back.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <nav_msgs/OccupancyGrid.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <octomap_msgs/Octomap.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/MagneticField.h>
#include <sensor_msgs/NavSatFix.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "bridge.hpp"

namespace pade_ros {

/// @{
/// The bytes of images are not copied: the message lives as long as the value.
Image value_of(const sensor_msgs::ImageConstPtr& message);
Image value_of(const sensor_msgs::CompressedImageConstPtr& message);
CameraInfo value_of(const sensor_msgs::CameraInfo& message);
PoseMessage value_of(const nav_msgs::Odometry& message);
PoseMessage value_of(const geometry_msgs::PoseStamped& message);
ImuMessage value_of(const sensor_msgs::Imu& message);
FixMessage value_of(const sensor_msgs::NavSatFix& message);
VelocityMessage value_of(const geometry_msgs::TwistWithCovarianceStamped& message);
FieldMessage value_of(const sensor_msgs::MagneticField& message);
PressureMessage value_of(const sensor_msgs::FluidPressure& message);
Placement value_of(const geometry_msgs::Transform& message);
/// @}

/// @{
/// What a frame gave.
sensor_msgs::PointCloud2 cloud_of(const FrameResult& result);
/// 32FC1. @param values  rows one behind the other
sensor_msgs::Image image_of(const FrameResult& result, const float* values);
nav_msgs::Path path_of(const FrameResult& result);
/// Of the vehicle, and of the map's own frame where it has one.
/// @param with_body  that of the vehicle too
std::vector<geometry_msgs::TransformStamped> transforms_of(const FrameResult& result, bool with_body);
/// @}

/// @{
/// The map.
octomap_msgs::Octomap octomap_of(const MapResult& result, bool binary);
visualization_msgs::MarkerArray markers_of(const MapResult& result);
sensor_msgs::PointCloud2 centres_of(const MapResult& result);
nav_msgs::OccupancyGrid grid_of(const MapResult& result);
/// @}

/// @param node  name of the node, before that of each part
diagnostic_msgs::DiagnosticArray diagnostics_of(const std::vector<Diagnosis>& all, const std::string& node);

}  // namespace pade_ros
