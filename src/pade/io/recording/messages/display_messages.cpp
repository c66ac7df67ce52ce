#include "pade/io/recording/messages/display_messages.hpp"

#include <cstddef>

#include "pade/io/recording/messages/message_writer.hpp"

namespace pade::io {
namespace {

constexpr std::int32_t kCubeList = 6;  // visualization_msgs/Marker

std::int32_t number_of(CubeMarker::Action action) {
  switch (action) {
    case CubeMarker::Action::put:
      return 0;
    case CubeMarker::Action::remove:
      return 2;
    case CubeMarker::Action::remove_all:
      return 3;
  }
  return 0;
}

void write_colour(MessageWriter& out, const std::array<float, 3>& colour) {
  for (const float part : colour) out.number(part);
  out.number(1.0F);
}

void write_marker(MessageWriter& out, const MessageHeader& header, const CubeMarker& marker) {
  out.header(header);
  out.text("occupied");
  out.number(marker.number);
  out.number(kCubeList);
  out.number(number_of(marker.action));
  out.vector(Eigen::Vector3d::Zero());
  out.quaternion(Eigen::Quaterniond::Identity());
  out.vector(Eigen::Vector3d::Constant(marker.side));
  write_colour(out, {1, 1, 1});
  out.number(std::int32_t{0});  // it stays until it is taken away
  out.number(std::uint32_t{0});
  out.number(std::uint8_t{0});
  out.number(static_cast<std::uint32_t>(marker.centres.size()));
  for (const Eigen::Vector3f& centre : marker.centres) out.vector(centre.cast<double>());
  out.number(static_cast<std::uint32_t>(marker.colours.size()));
  for (const auto& colour : marker.colours) write_colour(out, colour);
  out.text("");  // texture: its place, its image, where it lies on the cubes
  out.header({});
  out.text("");
  out.bytes("");
  out.number(std::uint32_t{0});
  out.text("");
  out.text("");  // mesh
  out.text("");
  out.bytes("");
  out.number(std::uint8_t{0});
}

}  // namespace

std::string write_point_cloud(const MessageHeader& header, std::span<const DisplayPoint> points) {
  constexpr std::uint8_t kFloat32 = 7;
  constexpr std::array<std::string_view, 4> kFields{"x", "y", "z", "sigma"};
  static_assert(sizeof(DisplayPoint) == kFields.size() * sizeof(float));
  MessageWriter out(MessageEncoding::cdr);
  out.header(header);
  out.number(std::uint32_t{1});
  out.number(static_cast<std::uint32_t>(points.size()));
  out.number(static_cast<std::uint32_t>(kFields.size()));
  std::uint32_t offset = 0;
  for (const std::string_view field : kFields) {
    out.text(field);
    out.number(offset);
    out.number(kFloat32);
    out.number(std::uint32_t{1});
    offset += sizeof(float);
  }
  out.number(std::uint8_t{0});
  out.number(offset);
  out.number(static_cast<std::uint32_t>(offset * points.size()));
  out.bytes({reinterpret_cast<const char*>(points.data()), points.size_bytes()});
  out.number(std::uint8_t{1});
  return out.take();
}

std::string write_cubes(const MessageHeader& header, std::span<const CubeMarker> markers) {
  MessageWriter out(MessageEncoding::cdr);
  out.number(static_cast<std::uint32_t>(markers.size()));
  for (const CubeMarker& marker : markers) write_marker(out, header, marker);
  return out.take();
}

std::string write_octomap(const MessageHeader& header, std::string_view file, double voxel, bool binary) {
  constexpr std::string_view kData = "\ndata\n";
  const std::size_t at = file.find(kData);
  MessageWriter out(MessageEncoding::cdr);
  out.header(header);
  out.number(static_cast<std::uint8_t>(binary ? 1 : 0));
  out.text("OcTree");
  out.number(voxel);
  out.bytes(at == std::string_view::npos ? std::string_view() : file.substr(at + kData.size()));
  return out.take();
}

std::string write_path(const MessageHeader& header, std::span<const PathPose> poses) {
  MessageWriter out(MessageEncoding::cdr);
  out.header(header);
  out.number(static_cast<std::uint32_t>(poses.size()));
  for (const PathPose& pose : poses) {
    out.header({pose.time, header.frame});
    out.vector(pose.pose.translation);
    out.quaternion(pose.pose.rotation);
  }
  return out.take();
}

std::string write_range_scan(const MessageHeader& header, const RangeScan& scan) {
  MessageWriter out(MessageEncoding::cdr);
  out.header(header);
  const double last = scan.ranges.empty() ? 0 : static_cast<double>(scan.ranges.size() - 1);
  for (const double value :
       {scan.first, scan.first + last * scan.step, scan.step, 0.0, 0.0, scan.nearest, scan.farthest})
    out.number(static_cast<float>(value));
  out.number(static_cast<std::uint32_t>(scan.ranges.size()));
  for (const float range : scan.ranges) out.number(range);
  out.number(std::uint32_t{0});  // there are no intensities
  return out.take();
}

std::string write_diagnosis(const MessageHeader& header, const Diagnosis& diagnosis) {
  MessageWriter out(MessageEncoding::cdr);
  out.header(header);
  out.number(std::uint32_t{1});
  out.number(diagnosis.level);
  out.text(diagnosis.name);
  out.text(diagnosis.message);
  out.text("");
  out.number(static_cast<std::uint32_t>(diagnosis.values.size()));
  for (const auto& [key, value] : diagnosis.values) {
    out.text(key);
    out.text(value);
  }
  return out.take();
}

}  // namespace pade::io
