// Messages of ROS as bytes, for ROS 1 and ROS 2: the other way round of messages.hpp.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {

static_assert(std::endian::native == std::endian::little, "recordings are written as numbers lie in memory");

/// Fields of a message, in order.
class MessageWriter {
 public:
  explicit MessageWriter(MessageEncoding encoding);

  template <class Number>
  void number(Number value) {
    align(sizeof(Number));
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(Number));
  }
  void text(std::string_view text);
  void bytes(std::string_view bytes);
  void header(const MessageHeader& header);
  void vector(const Eigen::Vector3d& vector);
  void quaternion(const Eigen::Quaterniond& rotation);
  template <std::size_t count>
  void numbers(const std::array<double, count>& values) {
    for (const double value : values) number(value);
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  void align(std::size_t size);
  std::string bytes_;
  MessageEncoding encoding_;
};

/// A coordinate frame in another.
struct NamedTransform {
  MessageHeader header;  ///< its frame is the parent
  std::string child;
  Pose pose;  ///< of the child in the parent
};

/// @{
/// Whole messages; the names are those of the types.
/// @param image  8 or 16 bit, grey or BGR; or CV_32FC1
std::string write_image(const MessageHeader& header, const cv::Mat& image, MessageEncoding encoding);
/// @param format  "png", "jpeg"
std::string write_compressed_image(const MessageHeader& header, std::string_view format,
                                   std::string_view file, MessageEncoding encoding);
std::string write_camera_info(const MessageHeader& header, const Camera& camera, MessageEncoding encoding);
/// @param child  whose pose it is
std::string write_odometry(const MessageHeader& header, std::string_view child, const Pose& pose,
                           MessageEncoding encoding);
/// @param covariance  of translation and rotation
std::string write_pose_with_covariance(const MessageHeader& header, const Pose& pose,
                                       const Matrix6d& covariance, MessageEncoding encoding);
/// One transform.
std::string write_transform(const MessageHeader& header, std::string_view child, const Pose& pose,
                            MessageEncoding encoding);
std::string write_transforms(std::span<const NamedTransform> transforms, MessageEncoding encoding);
std::string write_imu(const MessageHeader& header, const Eigen::Vector3d& angular_rate,
                      const Eigen::Vector3d& specific_force, MessageEncoding encoding);
/// @param place  latitude, longitude (degrees), height (m); `covariance` east, north, up, m²
std::string write_nav_sat_fix(const MessageHeader& header, const Eigen::Vector3d& place,
                              const Eigen::Matrix3d& covariance, MessageEncoding encoding);
/// Velocity east, north, up, m/s.
std::string write_velocity(const MessageHeader& header, const Eigen::Vector3d& velocity,
                           const Eigen::Matrix3d& covariance, MessageEncoding encoding);
/// @param tesla  in the axes of the frame
std::string write_magnetic_field(const MessageHeader& header, const Eigen::Vector3d& tesla,
                                 MessageEncoding encoding);
std::string write_pressure(const MessageHeader& header, double pascal, MessageEncoding encoding);
/// @}

}  // namespace pade::io
