// Messages that Foxglove and RViz draw, as bytes of ROS 2 (CDR): point clouds, cubes, paths, sectors, health.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {

/// A point of a cloud with what is known of it.
struct DisplayPoint {
  float x = 0, y = 0, z = 0;  ///< m, axes of the message's frame
  float sigma = 0;            ///< standard deviation of its depth, m
};
/// sensor_msgs/PointCloud2 with the fields x, y, z, sigma.
std::string write_point_cloud(const MessageHeader& header, std::span<const DisplayPoint> points);

/// Cubes that are drawn, and taken away, together.
struct CubeMarker {
  enum class Action : std::uint8_t {
    put,         ///< in the place of those of this number
    remove,      ///< those of this number
    remove_all,  ///< of all numbers
  };
  Action action = Action::put;
  std::int32_t number = 0;
  double side = 0;                              ///< m
  std::vector<Eigen::Vector3f> centres;         ///< m, axes of the message's frame
  std::vector<std::array<float, 3>> colours{};  ///< red, green, blue, 0 to 1; one for each centre
};
/// visualization_msgs/MarkerArray of lists of cubes, in the namespace "occupied".
std::string write_cubes(const MessageHeader& header, std::span<const CubeMarker> markers);

/// octomap_msgs/Octomap of a map file (map_files.hpp): what stands behind its header.
/// @param file     content of a .bt (`binary`) or .ot
/// @param voxel    side, m
std::string write_octomap(const MessageHeader& header, std::string_view file, double voxel, bool binary);

/// A pose at a time.
struct PathPose {
  Time time;
  Pose pose;  ///< in the message's frame
};
/// nav_msgs/Path.
std::string write_path(const MessageHeader& header, std::span<const PathPose> poses);

/// Distances around a vehicle.
struct RangeScan {
  double first = 0;             ///< bearing of the first range from ahead, counterclockwise, rad
  double step = 0;              ///< from one bearing to the next, rad
  double nearest = 0;           ///< that is measured, m
  double farthest = 0;          ///< the same
  std::vector<float> ranges{};  ///< m; infinite: nothing up to `farthest`; NaN: not known
};
/// sensor_msgs/LaserScan.
std::string write_range_scan(const MessageHeader& header, const RangeScan& scan);

/// How something is.
struct Diagnosis {
  std::uint8_t level = 0;  ///< 0 well, 1 warning, 2 error
  std::string name, message;
  std::vector<std::pair<std::string, std::string>> values{};
};
/// diagnostic_msgs/DiagnosticArray of one status.
std::string write_diagnosis(const MessageHeader& header, const Diagnosis& diagnosis);

}  // namespace pade::io
