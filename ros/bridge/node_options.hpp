// The parameters of the node.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include <pade/core/options.hpp>
#include <pade/core/result.hpp>
#include <pade/navigation/navigator.hpp>
#include <pade/pipeline/obstacle_mapper.hpp>

#include "bridge.hpp"

namespace pade_ros {

/// Where poses come from.
enum class PoseKind : std::uint8_t {
  odometry,  ///< nav_msgs/Odometry
  pose,      ///< geometry_msgs/PoseStamped
  tf,        ///< transforms
  sensors,   ///< our own filter on sensor_msgs/Imu and NavSatFix
};

inline pade::ObstacleMapperOptions mapper_of_long_flights() {
  pade::ObstacleMapperOptions options;
  options.map.pack_beyond = 50;
  return options;
}

struct NodeOptions {
  PoseKind poses = PoseKind::odometry;
  std::string world_frame;
  std::string map_frame = "pade_map";
  std::string base_frame = "base_link";
  std::string camera_frame;
  std::string mounting;
  bool rectified = false;
  bool compressed = false;
  double max_wait_for_pose = 0.2;
  int most_waiting = 4;
  double max_latency = 0.25;
  double time_offset = 0;
  double velocity_sigma = 0.1;
  double rotation_sigma = 0.004;
  double least_depth = 0.02;
  int cloud_step = 2;
  double map_rate = 1;
  double occupancy_min_z = -std::numeric_limits<double>::infinity();
  double occupancy_max_z = std::numeric_limits<double>::infinity();
  std::string map_file = "map.bt";
  bool save_on_exit = false;
  bool publish_tf = true;
  pade::navigation::NavigatorOptions navigator;
  pade::ObstacleMapperOptions mapper = mapper_of_long_flights();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("poses", self.poses, "odometry | pose | tf | sensors: where poses come from");
    field("world_frame", self.world_frame,
          "of the map; empty: that of the poses, and map for tf and sensors");
    field("map_frame", self.map_frame,
          "of the map where the poses are so far from their 0 0 0 that it has one of its own");
    field("base_frame", self.base_frame, "whose poses PoseStamped and the filter's transform have");
    field("camera_frame", self.camera_frame, "empty: that of the images");
    field("mounting", self.mounting,
          "camera on the frame of the poses, x y z qx qy qz qw; empty: as the transforms say");
    field("rectified", self.rectified, "the images are rectified: P of camera_info is their camera");
    field("compressed", self.compressed, "images are sensor_msgs/CompressedImage");
    field("max_wait_for_pose", self.max_wait_for_pose, "a frame waits so long for its pose, s");
    field("most_waiting", self.most_waiting, "frames that wait at most");
    field("max_latency", self.max_latency,
          "frames that would be mapped later after their arrival are passed over for newer ones, s; 0 = all "
          "are mapped, for bags");
    field("time_offset", self.time_offset, "time of a pose = time of the image + this, s");
    field("velocity_sigma", self.velocity_sigma,
          "of the poses' velocity, m/s: error of the way between frames");
    field("rotation_sigma", self.rotation_sigma,
          "of their turn between frames, rad; both 0: the poses are exact");
    field("least_depth", self.least_depth, "share of the pixels with depth below which a frame gave none");
    field("cloud_step", self.cloud_step, "the cloud has every so-manieth pixel of a row and a column");
    field("map_rate", self.map_rate, "at which the map is published at most, Hz");
    field("occupancy_min_z", self.occupancy_min_z, "lower bound of what projected_map shows, m");
    field("occupancy_max_z", self.occupancy_max_z, "upper bound, m");
    field("map_file", self.map_file, "file of save_map, .bt or .ot");
    field("save_on_exit", self.save_on_exit, "the map is saved when the node ends");
    field("publish_tf", self.publish_tf, "the filter's pose as a transform (poses: sensors)");
    field("navigator", self.navigator, "our own filter (poses: sensors)");
    field("mapper", self.mapper, "depth and map");
  }
};
/// Refuses what makes no sense.
pade::Status check(const NodeOptions& options);

/// Errors name the parameter.
pade::Result<NodeOptions> read_parameters(const Parameters& parameters);

/// "x y z qx qy qz qw".
pade::Result<pade::Pose> read_mounting(const std::string& text);

}  // namespace pade_ros

template <>
struct pade::EnumNames<pade_ros::PoseKind> {
  static constexpr std::array names = {std::pair{pade_ros::PoseKind::odometry, std::string_view("odometry")},
                                       std::pair{pade_ros::PoseKind::pose, std::string_view("pose")},
                                       std::pair{pade_ros::PoseKind::tf, std::string_view("tf")},
                                       std::pair{pade_ros::PoseKind::sensors, std::string_view("sensors")}};
};
