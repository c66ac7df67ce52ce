#include "pade/io/recording/messages/message_writer.hpp"

#include "pade/io/sequence/calibration.hpp"

namespace pade::io {
namespace {

constexpr std::size_t kEncapsulation = 4;
constexpr std::array<double, 9> kNothing9{};
constexpr std::array<double, 36> kNothing36{};

std::array<double, 9> rows_of(const Eigen::Matrix3d& matrix) {
  std::array<double, 9> rows{};
  for (int i = 0; i < 9; ++i) rows[static_cast<std::size_t>(i)] = matrix(i / 3, i % 3);
  return rows;
}

/// Coefficients as many as the model has.
std::size_t coefficients_of(Distortion model) {
  switch (model) {
    case Distortion::none:
      return 0;
    case Distortion::plumb_bob:
      return 5;
    case Distortion::rational_polynomial:
      return 8;
    case Distortion::equidistant:
      return 4;
  }
  return 0;
}

}  // namespace

MessageWriter::MessageWriter(MessageEncoding encoding) : encoding_(encoding) {
  if (encoding == MessageEncoding::cdr) bytes_.assign({0, 1, 0, 0});  // the lowest byte first
}

void MessageWriter::align(std::size_t size) {
  if (encoding_ == MessageEncoding::ros1) return;
  const std::size_t at = bytes_.size() - kEncapsulation;
  bytes_.append((size - at % size) % size, '\0');
}

void MessageWriter::text(std::string_view text) {
  const bool ros2 = encoding_ == MessageEncoding::cdr;
  number(static_cast<std::uint32_t>(text.size() + (ros2 ? 1 : 0)));
  bytes_ += text;
  if (ros2) bytes_ += '\0';
}

void MessageWriter::bytes(std::string_view bytes) {
  number(static_cast<std::uint32_t>(bytes.size()));
  bytes_ += bytes;
}

void MessageWriter::header(const MessageHeader& header) {
  if (encoding_ == MessageEncoding::ros1) number(std::uint32_t{0});
  constexpr std::int64_t kSecond = 1'000'000'000;
  number(static_cast<std::uint32_t>(header.stamp.nanoseconds / kSecond));
  number(static_cast<std::uint32_t>(header.stamp.nanoseconds % kSecond));
  text(header.frame);
}

void MessageWriter::vector(const Eigen::Vector3d& vector) {
  for (const double value : vector) number(value);
}

void MessageWriter::quaternion(const Eigen::Quaterniond& rotation) {
  for (const double value : rotation.coeffs()) number(value);
}

std::string write_image(const MessageHeader& header, const cv::Mat& image, MessageEncoding encoding) {
  const bool deep = image.depth() == CV_16U;
  const std::string_view name = image.depth() == CV_32F ? "32FC1"
                                : image.channels() == 3 ? (deep ? "bgr16" : "bgr8")
                                                        : (deep ? "mono16" : "mono8");
  const std::size_t row = static_cast<std::size_t>(image.cols) * image.elemSize();
  MessageWriter out(encoding);
  out.header(header);
  out.number(static_cast<std::uint32_t>(image.rows));
  out.number(static_cast<std::uint32_t>(image.cols));
  out.text(name);
  out.number(std::uint8_t{0});
  out.number(static_cast<std::uint32_t>(row));
  std::string pixels;
  pixels.reserve(row * static_cast<std::size_t>(image.rows));
  for (int y = 0; y < image.rows; ++y) pixels.append(reinterpret_cast<const char*>(image.ptr(y)), row);
  out.bytes(pixels);
  return out.take();
}

std::string write_compressed_image(const MessageHeader& header, std::string_view format,
                                   std::string_view file, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.text(format);
  out.bytes(file);
  return out.take();
}

std::string write_camera_info(const MessageHeader& header, const Camera& camera, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.number(static_cast<std::uint32_t>(camera.height));
  out.number(static_cast<std::uint32_t>(camera.width));
  const std::size_t count = coefficients_of(camera.distortion);
  out.text(count == 0 ? "plumb_bob" : lens_name(camera.distortion));  // no coefficients: an ideal lens
  out.number(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) out.number(camera.coefficients[i]);
  out.numbers(std::array<double, 9>{camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  out.numbers(std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1});
  out.numbers(std::array<double, 12>{camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) out.number(std::uint32_t{0});  // binning, region of interest
  out.number(std::uint8_t{0});
  return out.take();
}

std::string write_odometry(const MessageHeader& header, std::string_view child, const Pose& pose,
                           MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.text(child);
  out.vector(pose.translation);
  out.quaternion(pose.rotation);
  out.numbers(kNothing36);
  out.vector(Eigen::Vector3d::Zero());
  out.vector(Eigen::Vector3d::Zero());
  out.numbers(kNothing36);
  return out.take();
}

std::string write_pose_with_covariance(const MessageHeader& header, const Pose& pose,
                                       const Matrix6d& covariance, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.vector(pose.translation);
  out.quaternion(pose.rotation);
  for (int i = 0; i < 36; ++i) out.number(covariance(i / 6, i % 6));
  return out.take();
}

std::string write_transform(const MessageHeader& header, std::string_view child, const Pose& pose,
                            MessageEncoding encoding) {
  const NamedTransform transform{header, std::string(child), pose};
  return write_transforms(std::span(&transform, 1), encoding);
}

std::string write_transforms(std::span<const NamedTransform> transforms, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.number(static_cast<std::uint32_t>(transforms.size()));
  for (const NamedTransform& transform : transforms) {
    out.header(transform.header);
    out.text(transform.child);
    out.vector(transform.pose.translation);
    out.quaternion(transform.pose.rotation);
  }
  return out.take();
}

std::string write_imu(const MessageHeader& header, const Eigen::Vector3d& angular_rate,
                      const Eigen::Vector3d& specific_force, MessageEncoding encoding) {
  MessageWriter out(encoding);
  std::array<double, 9> none{};
  none[0] = -1;  // there is no orientation
  out.header(header);
  out.quaternion(Eigen::Quaterniond::Identity());
  out.numbers(none);
  out.vector(angular_rate);
  out.numbers(kNothing9);
  out.vector(specific_force);
  out.numbers(kNothing9);
  return out.take();
}

std::string write_nav_sat_fix(const MessageHeader& header, const Eigen::Vector3d& place,
                              const Eigen::Matrix3d& covariance, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.number(std::int8_t{0});
  out.number(std::uint16_t{1});
  out.vector(place);
  out.numbers(rows_of(covariance));
  out.number(std::uint8_t{3});  // the whole covariance is known
  return out.take();
}

std::string write_velocity(const MessageHeader& header, const Eigen::Vector3d& velocity,
                           const Eigen::Matrix3d& covariance, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.vector(velocity);
  out.vector(Eigen::Vector3d::Zero());
  std::array<double, 36> whole{};
  for (std::size_t i = 0; i < 9; ++i)
    whole[6 * (i / 3) + i % 3] =
        covariance(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3));
  out.numbers(whole);
  return out.take();
}

std::string write_magnetic_field(const MessageHeader& header, const Eigen::Vector3d& tesla,
                                 MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.vector(tesla);
  out.numbers(kNothing9);
  return out.take();
}

std::string write_pressure(const MessageHeader& header, double pascal, MessageEncoding encoding) {
  MessageWriter out(encoding);
  out.header(header);
  out.number(pascal);
  out.number(0.0);
  return out.take();
}

}  // namespace pade::io
