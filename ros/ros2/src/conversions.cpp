#include "conversions.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace pade_ros {
namespace {

Stamp nanoseconds(const builtin_interfaces::msg::Time& time) {
  return 1'000'000'000 * static_cast<Stamp>(time.sec) + static_cast<Stamp>(time.nanosec);
}

builtin_interfaces::msg::Time ros_time(Stamp stamp) {
  builtin_interfaces::msg::Time time;
  time.sec = static_cast<std::int32_t>(stamp / 1'000'000'000);
  time.nanosec = static_cast<std::uint32_t>(stamp % 1'000'000'000);
  return time;
}

std_msgs::msg::Header header(Stamp stamp, const std::string& frame) {
  std_msgs::msg::Header out;
  out.stamp = ros_time(stamp);
  out.frame_id = frame;
  return out;
}

template <class Quaternion>
std::array<double, 4> xyzw(const Quaternion& q) {
  return {q.x, q.y, q.z, q.w};
}

template <class Vector>
std::array<double, 3> xyz(const Vector& v) {
  return {v.x, v.y, v.z};
}

geometry_msgs::msg::Pose pose_of(const Placement& placement) {
  geometry_msgs::msg::Pose out;
  out.position.x = placement.position[0];
  out.position.y = placement.position[1];
  out.position.z = placement.position[2];
  out.orientation.x = placement.xyzw[0];
  out.orientation.y = placement.xyzw[1];
  out.orientation.z = placement.xyzw[2];
  out.orientation.w = placement.xyzw[3];
  return out;
}

sensor_msgs::msg::PointField field(const char* name, std::uint32_t offset) {
  sensor_msgs::msg::PointField out;
  out.name = name;
  out.offset = offset;
  out.datatype = sensor_msgs::msg::PointField::FLOAT32;
  out.count = 1;
  return out;
}

void put(sensor_msgs::msg::PointCloud2& cloud, std::size_t at, const void* value) {
  std::memcpy(&cloud.data[at], value, 4);
}

/// Room for so many points of so many fields of four bytes.
void make_room(sensor_msgs::msg::PointCloud2& cloud, std::size_t points) {
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(points);
  cloud.point_step = static_cast<std::uint32_t>(4 * cloud.fields.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.resize(cloud.row_step);
  cloud.is_dense = true;
}

/// Colours go round every ten metres of height, as a rainbow does from red to violet.
std_msgs::msg::ColorRGBA colour_of_height(float z) {
  constexpr float kRound = 10;  // m
  const float hue = 6 * (z / kRound - std::floor(z / kRound));
  const auto part = [&](float offset) {
    const float k = std::fmod(offset + hue, 6.0F);
    return 1 - 0.75F * std::min(std::max(std::min(k, 4 - k), 0.0F), 1.0F);
  };
  std_msgs::msg::ColorRGBA out;
  out.r = part(5);
  out.g = part(3);
  out.b = part(1);
  out.a = 1;
  return out;
}

}  // namespace

Image value_of(const std::shared_ptr<const sensor_msgs::msg::Image>& message) {
  Image out;
  out.stamp = nanoseconds(message->header.stamp);
  out.frame = message->header.frame_id;
  out.height = message->height;
  out.width = message->width;
  out.step = message->step;
  out.encoding = message->encoding;
  out.big_endian = message->is_bigendian != 0;
  out.data = message->data.data();
  out.size = message->data.size();
  out.owner = message;
  return out;
}

Image value_of(const std::shared_ptr<const sensor_msgs::msg::CompressedImage>& message) {
  Image out;
  out.stamp = nanoseconds(message->header.stamp);
  out.frame = message->header.frame_id;
  out.encoding = message->format;
  out.compressed = true;
  out.data = message->data.data();
  out.size = message->data.size();
  out.owner = message;
  return out;
}

CameraInfo value_of(const sensor_msgs::msg::CameraInfo& message) {
  CameraInfo out;
  out.frame = message.header.frame_id;
  out.height = message.height;
  out.width = message.width;
  out.model = message.distortion_model;
  out.d = message.d;
  std::copy(message.k.begin(), message.k.end(), out.k.begin());
  std::copy(message.r.begin(), message.r.end(), out.r.begin());
  std::copy(message.p.begin(), message.p.end(), out.p.begin());
  out.binning_x = message.binning_x;
  out.binning_y = message.binning_y;
  out.x_offset = message.roi.x_offset;
  out.y_offset = message.roi.y_offset;
  return out;
}

PoseMessage value_of(const nav_msgs::msg::Odometry& message) {
  PoseMessage out;
  out.stamp = nanoseconds(message.header.stamp);
  out.frame = message.header.frame_id;
  out.child = message.child_frame_id;
  out.pose = {xyz(message.pose.pose.position), xyzw(message.pose.pose.orientation)};
  return out;
}

PoseMessage value_of(const geometry_msgs::msg::PoseStamped& message) {
  PoseMessage out;
  out.stamp = nanoseconds(message.header.stamp);
  out.frame = message.header.frame_id;
  out.pose = {xyz(message.pose.position), xyzw(message.pose.orientation)};
  return out;
}

ImuMessage value_of(const sensor_msgs::msg::Imu& message) {
  ImuMessage out;
  out.stamp = nanoseconds(message.header.stamp);
  out.frame = message.header.frame_id;
  out.angular_rate = xyz(message.angular_velocity);
  out.specific_force = xyz(message.linear_acceleration);
  const std::array<double, 3> zero{};
  out.complete = (message.angular_velocity_covariance[0] != -1 || out.angular_rate != zero) &&
                 (message.linear_acceleration_covariance[0] != -1 || out.specific_force != zero);
  return out;
}

FixMessage value_of(const sensor_msgs::msg::NavSatFix& message) {
  FixMessage out;
  out.stamp = nanoseconds(message.header.stamp);
  out.frame = message.header.frame_id;
  out.status = message.status.status;
  out.latitude = message.latitude;
  out.longitude = message.longitude;
  out.height = message.altitude;
  std::copy(message.position_covariance.begin(), message.position_covariance.end(), out.covariance.begin());
  out.covariance_kind = message.position_covariance_type;
  return out;
}

VelocityMessage value_of(const geometry_msgs::msg::TwistWithCovarianceStamped& message) {
  VelocityMessage out;
  out.stamp = nanoseconds(message.header.stamp);
  out.velocity = xyz(message.twist.twist.linear);
  const auto& c = message.twist.covariance;
  out.variance = {c[0], c[7], c[14]};
  return out;
}

FieldMessage value_of(const sensor_msgs::msg::MagneticField& message) {
  return {nanoseconds(message.header.stamp), message.header.frame_id, xyz(message.magnetic_field)};
}

PressureMessage value_of(const sensor_msgs::msg::FluidPressure& message) {
  return {nanoseconds(message.header.stamp), message.fluid_pressure};
}

Placement value_of(const geometry_msgs::msg::Transform& message) {
  return {xyz(message.translation), xyzw(message.rotation)};
}

sensor_msgs::msg::PointCloud2 cloud_of(const FrameResult& result) {
  sensor_msgs::msg::PointCloud2 out;
  out.header = header(result.stamp, result.world_frame);
  out.fields = {field("x", 0), field("y", 4), field("z", 8), field("sigma", 12), field("rgb", 16)};
  make_room(out, result.cloud.size());
  std::size_t at = 0;
  for (const CloudPoint& point : result.cloud) {
    const std::uint32_t rgb = static_cast<std::uint32_t>(point.r) << 16U |
                              static_cast<std::uint32_t>(point.g) << 8U | static_cast<std::uint32_t>(point.b);
    const std::array<const void*, 5> values = {&point.x, &point.y, &point.z, &point.sigma, &rgb};
    for (const void* const value : values) {
      put(out, at, value);
      at += 4;
    }
  }
  return out;
}

sensor_msgs::msg::Image image_of(const FrameResult& result, const float* values) {
  sensor_msgs::msg::Image out;
  out.header = header(result.stamp, result.camera_frame);
  out.width = static_cast<std::uint32_t>(result.width);
  out.height = static_cast<std::uint32_t>(result.height);
  out.encoding = "32FC1";
  out.step = 4 * out.width;
  out.data.resize(static_cast<std::size_t>(out.step) * out.height);
  std::memcpy(out.data.data(), values, out.data.size());
  return out;
}

nav_msgs::msg::Path path_of(const FrameResult& result) {
  nav_msgs::msg::Path out;
  out.header = header(result.pose_stamp, result.world_frame);
  for (const PathPose& pose : *result.path) {
    geometry_msgs::msg::PoseStamped one;
    one.header = header(pose.stamp, result.world_frame);
    one.pose = pose_of(pose.T_world_camera);
    out.poses.push_back(one);
  }
  return out;
}

std::vector<geometry_msgs::msg::TransformStamped> transforms_of(const FrameResult& result, bool with_body) {
  std::vector<geometry_msgs::msg::TransformStamped> all;
  const auto add = [&](const std::string& child, const Placement& placement) {
    geometry_msgs::msg::TransformStamped out;
    out.header = header(result.pose_stamp, result.poses_frame);
    out.child_frame_id = child;
    const geometry_msgs::msg::Pose pose = pose_of(placement);
    out.transform.translation.x = pose.position.x;
    out.transform.translation.y = pose.position.y;
    out.transform.translation.z = pose.position.z;
    out.transform.rotation = pose.orientation;
    all.push_back(out);
  };
  if (with_body && !result.body_frame.empty()) add(result.body_frame, result.T_world_body);
  if (result.world_frame != result.poses_frame) add(result.world_frame, {result.origin, {0, 0, 0, 1}});
  return all;
}

octomap_msgs::msg::Octomap octomap_of(const MapResult& result, bool binary) {
  octomap_msgs::msg::Octomap out;
  out.header = header(result.stamp, result.world_frame);
  out.binary = binary;
  out.id = "OcTree";
  out.resolution = result.voxel;
  out.data = binary ? result.binary : result.full;
  return out;
}

visualization_msgs::msg::MarkerArray markers_of(const MapResult& result) {
  visualization_msgs::msg::Marker cubes;
  cubes.header = header(result.stamp, result.world_frame);
  cubes.ns = "occupied";
  cubes.type = visualization_msgs::msg::Marker::CUBE_LIST;
  cubes.action = result.occupied.empty() ? visualization_msgs::msg::Marker::DELETE
                                         : visualization_msgs::msg::Marker::ADD;
  cubes.pose.orientation.w = 1;
  cubes.scale.x = cubes.scale.y = cubes.scale.z = result.voxel;
  cubes.color.a = 1;
  for (const auto& centre : result.occupied) {
    geometry_msgs::msg::Point point;
    point.x = static_cast<double>(centre[0]);
    point.y = static_cast<double>(centre[1]);
    point.z = static_cast<double>(centre[2]);
    cubes.points.push_back(point);
    cubes.colors.push_back(colour_of_height(centre[2]));
  }
  visualization_msgs::msg::MarkerArray out;
  out.markers.push_back(cubes);
  return out;
}

sensor_msgs::msg::PointCloud2 centres_of(const MapResult& result) {
  sensor_msgs::msg::PointCloud2 out;
  out.header = header(result.stamp, result.world_frame);
  out.fields = {field("x", 0), field("y", 4), field("z", 8)};
  make_room(out, result.occupied.size());
  for (std::size_t i = 0; i < result.occupied.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) put(out, 12 * i + 4 * axis, &result.occupied[i][axis]);
  return out;
}

nav_msgs::msg::OccupancyGrid grid_of(const MapResult& result) {
  nav_msgs::msg::OccupancyGrid out;
  out.header = header(result.stamp, result.world_frame);
  out.info.map_load_time = out.header.stamp;
  out.info.resolution = static_cast<float>(result.voxel);
  out.info.width = static_cast<std::uint32_t>(result.columns);
  out.info.height = static_cast<std::uint32_t>(result.rows);
  out.info.origin.position.x = result.left;
  out.info.origin.position.y = result.bottom;
  out.info.origin.orientation.w = 1;
  out.data = result.cells;
  return out;
}

diagnostic_msgs::msg::DiagnosticArray diagnostics_of(const std::vector<Diagnosis>& all,
                                                     const std::string& node, Stamp now) {
  diagnostic_msgs::msg::DiagnosticArray out;
  out.header.stamp = ros_time(now);
  for (const Diagnosis& one : all) {
    diagnostic_msgs::msg::DiagnosticStatus status;
    status.level = one.level;
    status.name = node + ": " + one.name;
    status.message = one.message;
    status.hardware_id = node;
    for (const auto& [key, value] : one.values) {
      diagnostic_msgs::msg::KeyValue pair;
      pair.key = key;
      pair.value = value;
      status.values.push_back(pair);
    }
    out.status.push_back(status);
  }
  return out;
}

}  // namespace pade_ros
