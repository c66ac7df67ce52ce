#include "pade/io/recording/messages/messages.hpp"

#include <fmt/format.h>

namespace pade::io {
namespace {

constexpr std::size_t kEncapsulation = 4;  // bytes before a message in CDR

bool is_big_endian(std::string_view bytes, MessageEncoding encoding) {
  return encoding == MessageEncoding::cdr && bytes.size() > 1 && (bytes[1] & 1) == 0;
}

MessageHeader header_of(MessageReader& reader) {
  if (reader.ros1()) reader.number<std::uint32_t>();  // its number
  MessageHeader header;
  header.stamp = reader.stamp();
  header.frame = reader.text();
  return header;
}

/// The message, if its fields were all that the bytes hold. Writers of CDR may fill up to a multiple of 4.
template <class Message>
Result<Message> whole(const MessageReader& reader, Message message, std::size_t size) {
  const std::size_t filling = reader.ros1() ? 0 : kEncapsulation - 1;
  if (!reader.failed() && reader.left() <= filling) return message;
  return Error{reader.failed() ? fmt::format("the message ends within its fields, after {} bytes", size)
                               : fmt::format("the message has {} bytes more than its fields", reader.left())};
}

void read_pose(MessageReader& reader, PoseMessage& message) {
  message.position = reader.vector();
  message.xyzw = reader.quaternion();
}

PoseMessage transform_of(MessageReader& reader) {
  PoseMessage message;
  message.header = header_of(reader);
  message.child = reader.text();
  read_pose(reader, message);
  return message;
}

ImageMessage image_head_of(MessageReader& reader) {
  ImageMessage image;
  image.header = header_of(reader);
  image.height = reader.number<std::uint32_t>();
  image.width = reader.number<std::uint32_t>();
  image.encoding = reader.text();
  image.big_endian = reader.number<std::uint8_t>() != 0;
  image.step = reader.number<std::uint32_t>();
  return image;
}

}  // namespace

std::optional<MessageEncoding> message_encoding(std::string_view name) {
  if (name == "ros1") return MessageEncoding::ros1;
  if (name == "cdr") return MessageEncoding::cdr;
  return std::nullopt;
}

MessageReader::MessageReader(std::string_view bytes, MessageEncoding encoding)
    : reader_(bytes, is_big_endian(bytes, encoding)), encoding_(encoding) {
  if (encoding == MessageEncoding::cdr) reader_.take(kEncapsulation);
}

void MessageReader::align(std::size_t size) {
  if (encoding_ == MessageEncoding::ros1) return;
  const std::size_t at = reader_.at() - std::min(reader_.at(), kEncapsulation);
  reader_.take((size - at % size) % size);
}

std::string_view MessageReader::text() {
  const auto size = number<std::uint32_t>();
  std::string_view text = reader_.take(size);
  if (!ros1() && !text.empty()) text.remove_suffix(1);  // the zero at its end is counted
  return text;
}

std::string_view MessageReader::bytes() { return reader_.take(number<std::uint32_t>()); }

Eigen::Vector3d MessageReader::vector() {
  const auto x = number<double>(), y = number<double>(), z = number<double>();
  return {x, y, z};
}

Eigen::Vector4d MessageReader::quaternion() {
  const Eigen::Vector3d xyz = vector();
  return {xyz.x(), xyz.y(), xyz.z(), number<double>()};
}

std::vector<double> MessageReader::list() {
  const std::size_t count = number<std::uint32_t>();
  std::vector<double> values;
  for (std::size_t i = 0; i < count && !failed(); ++i) values.push_back(number<double>());
  return values;
}

Time MessageReader::stamp() {
  // ROS 2 has signed seconds, of which none before 1970 occur: both are read alike up to the year 2038.
  const std::int64_t seconds =
      ros1() ? std::int64_t{number<std::uint32_t>()} : std::int64_t{number<std::int32_t>()};
  return Time{1'000'000'000 * seconds + number<std::uint32_t>()};
}

Result<ImageMessage> read_image_message(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  ImageMessage image = image_head_of(reader);
  image.data = reader.bytes();
  return whole(reader, std::move(image), bytes.size());
}

Result<ImageMessage> read_image_head(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  ImageMessage image = image_head_of(reader);
  if (reader.failed()) return Error{"the message ends within its fields"};
  return image;
}

Result<CompressedImageMessage> read_compressed_image(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  CompressedImageMessage image;
  image.header = header_of(reader);
  image.format = reader.text();
  image.data = reader.bytes();
  return whole(reader, std::move(image), bytes.size());
}

Result<CameraInfoMessage> read_camera_info(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  CameraInfoMessage info;
  info.header = header_of(reader);
  info.height = reader.number<std::uint32_t>();
  info.width = reader.number<std::uint32_t>();
  info.model = reader.text();
  info.d = reader.list();
  reader.numbers(info.k);
  reader.numbers(info.r);
  reader.numbers(info.p);
  info.binning_x = reader.number<std::uint32_t>();
  info.binning_y = reader.number<std::uint32_t>();
  info.x_offset = reader.number<std::uint32_t>();
  info.y_offset = reader.number<std::uint32_t>();
  reader.number<std::uint32_t>();  // height and width of the region: some drivers write the whole image
  reader.number<std::uint32_t>();
  reader.number<std::uint8_t>();  // whether it is to be rectified
  return whole(reader, std::move(info), bytes.size());
}

Result<ImuMessage> read_imu_message(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  ImuMessage imu;
  std::array<double, 9> covariance{};
  imu.header = header_of(reader);
  reader.quaternion();
  reader.numbers(covariance);
  imu.angular_rate = reader.vector();
  reader.numbers(covariance);
  imu.has_rate = covariance[0] != -1 || !imu.angular_rate.isZero(0);
  imu.specific_force = reader.vector();
  reader.numbers(covariance);
  imu.has_force = covariance[0] != -1 || !imu.specific_force.isZero(0);
  return whole(reader, std::move(imu), bytes.size());
}

Result<NavSatFixMessage> read_nav_sat_fix(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  NavSatFixMessage fix;
  fix.header = header_of(reader);
  fix.status = reader.number<std::int8_t>();
  reader.number<std::uint16_t>();  // systems
  fix.latitude = reader.number<double>();
  fix.longitude = reader.number<double>();
  fix.height = reader.number<double>();
  reader.numbers(fix.covariance);
  fix.covariance_kind = reader.number<std::uint8_t>();
  return whole(reader, std::move(fix), bytes.size());
}

Result<VectorMessage> read_magnetic_field(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  VectorMessage field;
  std::array<double, 9> covariance{};
  field.header = header_of(reader);
  field.vector = reader.vector();
  reader.numbers(covariance);
  return whole(reader, std::move(field), bytes.size());
}

Result<PressureMessage> read_pressure(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  PressureMessage pressure;
  pressure.header = header_of(reader);
  pressure.pascal = reader.number<double>();
  reader.number<double>();  // variance
  return whole(reader, std::move(pressure), bytes.size());
}

Result<VectorMessage> read_twist(std::string_view type, std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  VectorMessage twist;
  twist.header = header_of(reader);
  twist.vector = reader.vector();
  reader.vector();  // rates
  if (type == "geometry_msgs/TwistWithCovarianceStamped") reader.numbers(twist.covariance);
  return whole(reader, std::move(twist), bytes.size());
}

Result<PoseMessage> read_pose_message(std::string_view type, std::string_view bytes,
                                      MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  if (type == "geometry_msgs/TransformStamped") return whole(reader, transform_of(reader), bytes.size());
  PoseMessage message;
  message.header = header_of(reader);
  if (type == "nav_msgs/Odometry") message.child = reader.text();
  read_pose(reader, message);
  if (type != "geometry_msgs/PoseStamped") reader.numbers(message.covariance);
  if (type == "nav_msgs/Odometry") {
    std::array<double, 36> covariance{};
    reader.vector();
    reader.vector();
    reader.numbers(covariance);
  }
  return whole(reader, std::move(message), bytes.size());
}

Result<std::vector<PoseMessage>> read_transforms(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  std::vector<PoseMessage> transforms;
  const auto count = reader.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && !reader.failed(); ++i) transforms.push_back(transform_of(reader));
  return whole(reader, std::move(transforms), bytes.size());
}

Result<MessageHeader> read_header(std::string_view bytes, MessageEncoding encoding) {
  MessageReader reader(bytes, encoding);
  MessageHeader header = header_of(reader);
  if (reader.failed()) return Error{"the message ends within its header"};
  return header;
}

}  // namespace pade::io
