// What the messages of ROS say that a flight needs, whether ROS 1 has written them or ROS 2 (CDR).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/recording/byte_reader.hpp"
#include "pade/io/recording/messages/image_messages.hpp"

namespace pade::io {

/// How messages are written.
enum class MessageEncoding : std::uint8_t {
  ros1,  ///< packed, the lowest byte first
  cdr,   ///< of ROS 2: aligned, behind four bytes that tell the order of bytes
};
/// Of Topic::encoding; empty for one that is not understood.
std::optional<MessageEncoding> message_encoding(std::string_view name);

/// Fields of a message, in order.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, MessageEncoding encoding);

  template <class Number>
  Number number() {
    align(sizeof(Number));
    return reader_.number<Number>();
  }
  std::string_view text();
  /// A list of bytes.
  std::string_view bytes();
  /// As many numbers as there are in `out`.
  template <std::size_t count>
  void numbers(std::array<double, count>& out) {
    for (double& value : out) value = number<double>();
  }
  Eigen::Vector3d vector();
  /// x y z w.
  Eigen::Vector4d quaternion();
  std::vector<double> list();
  Time stamp();
  [[nodiscard]] bool failed() const { return reader_.failed(); }
  [[nodiscard]] bool ros1() const { return encoding_ == MessageEncoding::ros1; }
  [[nodiscard]] std::size_t left() const { return reader_.left(); }

 private:
  void align(std::size_t size);
  ByteReader reader_;
  MessageEncoding encoding_;
};

/// sensor_msgs/Imu.
struct ImuMessage {
  MessageHeader header;
  Eigen::Vector3d angular_rate, specific_force;  ///< axes of the frame, rad/s, m/s²
  bool has_rate = true, has_force = true;  ///< false: zeros, whose covariance says that nobody measures them
};
/// sensor_msgs/NavSatFix.
struct NavSatFixMessage {
  MessageHeader header;
  std::int8_t status = 0;
  double latitude = 0, longitude = 0, height = 0;  ///< degrees, m
  std::array<double, 9> covariance{};              ///< east, north, up, m²
  std::uint8_t covariance_kind = 0;                ///< 0: unknown
};
/// sensor_msgs/MagneticField (T), geometry_msgs/TwistStamped, TwistWithCovarianceStamped (m/s).
struct VectorMessage {
  MessageHeader header;
  Eigen::Vector3d vector;
  std::array<double, 36> covariance{};  ///< of a twist; zeros where not stated
};
/// sensor_msgs/FluidPressure.
struct PressureMessage {
  MessageHeader header;
  double pascal = 0;
};
/// nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped, TransformStamped.
struct PoseMessage {
  MessageHeader header;
  std::string child;  ///< whose pose it is; empty where the message does not say
  Eigen::Vector3d position;
  Eigen::Vector4d xyzw;
  std::array<double, 36> covariance{};  ///< zeros where not stated
};

/// @{
/// Error where the bytes are too few or too many for the message.
Result<ImageMessage> read_image_message(std::string_view bytes, MessageEncoding encoding);
Result<CompressedImageMessage> read_compressed_image(std::string_view bytes, MessageEncoding encoding);
Result<CameraInfoMessage> read_camera_info(std::string_view bytes, MessageEncoding encoding);
Result<ImuMessage> read_imu_message(std::string_view bytes, MessageEncoding encoding);
Result<NavSatFixMessage> read_nav_sat_fix(std::string_view bytes, MessageEncoding encoding);
Result<VectorMessage> read_magnetic_field(std::string_view bytes, MessageEncoding encoding);
Result<PressureMessage> read_pressure(std::string_view bytes, MessageEncoding encoding);
/// @param type  one of those of VectorMessage
Result<VectorMessage> read_twist(std::string_view type, std::string_view bytes, MessageEncoding encoding);
/// @param type  one of those of PoseMessage
Result<PoseMessage> read_pose_message(std::string_view type, std::string_view bytes,
                                      MessageEncoding encoding);
/// tf2_msgs/TFMessage, tf/tfMessage.
Result<std::vector<PoseMessage>> read_transforms(std::string_view bytes, MessageEncoding encoding);
/// @}

/// The header with which a message begins; the bytes need not be all. Errors: too few of them.
Result<MessageHeader> read_header(std::string_view bytes, MessageEncoding encoding);

/// What an image is before its pixels: `data` is empty. The first 4 kB of the message are enough for any.
Result<ImageMessage> read_image_head(std::string_view bytes, MessageEncoding encoding);

}  // namespace pade::io
