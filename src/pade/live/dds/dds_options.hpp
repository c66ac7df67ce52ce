// Where a session meets ROS 2, and what its topics are called.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::live {

/// What the stamps of messages count.
enum class StampClock : std::uint8_t {
  system,  ///< since 1970, by this machine's clock: of nodes that run now
  played,  ///< of a recording that is played: the first message is of now
};

/// Messages that poses come in.
enum class PoseTopicType : std::uint8_t {
  odometry,              ///< nav_msgs/Odometry
  pose,                  ///< geometry_msgs/PoseStamped
  pose_with_covariance,  ///< geometry_msgs/PoseWithCovarianceStamped
};

/// Whose pose a message says.
enum class PoseOf : std::uint8_t {
  body,    ///< x forward, y left, z up
  camera,  ///< x right, y down, z forward
};

/// Options of DdsNetwork and what uses it.
struct DdsOptions {
  bool publish = false;    ///< cloud, depth, map, path, transforms, health
  int domain = -1;         ///< -1: ROS_DOMAIN_ID, else 0
  bool localhost = false;  ///< this machine alone; ROS_LOCALHOST_ONLY=1 says the same
  std::string name_space;  ///< before our topics and frames: "uav1"; empty: none
  StampClock clock = StampClock::system;
  std::string poses = "/odom";  ///< topic, with link.poses: dds
  PoseTopicType pose_type = PoseTopicType::odometry;
  PoseOf pose_of = PoseOf::body;
  std::string camera_info = "/camera/camera_info";  ///< topic, where camera.calibration is empty
  double map_period = 1;                            ///< s from one map to the next, at least

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("publish", self.publish, "cloud, depth, map, path, transforms and health, for ROS 2");
    field("domain", self.domain, "of DDS; -1 = ROS_DOMAIN_ID, else 0");
    field("localhost", self.localhost, "this machine alone; ROS_LOCALHOST_ONLY=1 says the same");
    field("namespace", self.name_space, "before our topics and frames; empty = none");
    field("clock", self.clock,
          "of the stamps. system: this machine's, since 1970; played: of a recording, whose first message is "
          "of now");
    field("poses", self.poses, "topic of link.poses: dds");
    field("pose_type", self.pose_type,
          "odometry: nav_msgs/Odometry; pose: geometry_msgs/PoseStamped; pose_with_covariance: "
          "PoseWithCovarianceStamped");
    field("pose_of", self.pose_of, "body: forward, left, up; camera: right, down, forward");
    field("camera_info", self.camera_info, "topic of the lens, where camera.calibration is empty");
    field("map_period", self.map_period, "from one map to the next at least, s");
  }
};
/// Refuses numbers and names that make no sense.
Status check(const DdsOptions& options);

/// "/camera/image_raw": a name of ROS 2 that begins at its root.
bool is_topic(std::string_view name);

/// The domain that the options and the environment say. Error: ROS_DOMAIN_ID is no number of one.
Result<int> domain_of(const DdsOptions& options);
/// Whether the options or the environment keep to this machine.
bool is_local(const DdsOptions& options);
/// "/uav1/pade/cloud" of "/pade/cloud".
std::string own_topic(const DdsOptions& options, std::string_view topic);

}  // namespace pade::live

template <>
struct pade::EnumNames<pade::live::StampClock> {
  static constexpr std::array names = {std::pair{pade::live::StampClock::system, std::string_view("system")},
                                       std::pair{pade::live::StampClock::played, std::string_view("played")}};
};
template <>
struct pade::EnumNames<pade::live::PoseTopicType> {
  static constexpr std::array names = {
      std::pair{pade::live::PoseTopicType::odometry, std::string_view("odometry")},
      std::pair{pade::live::PoseTopicType::pose, std::string_view("pose")},
      std::pair{pade::live::PoseTopicType::pose_with_covariance, std::string_view("pose_with_covariance")}};
};
template <>
struct pade::EnumNames<pade::live::PoseOf> {
  static constexpr std::array names = {std::pair{pade::live::PoseOf::body, std::string_view("body")},
                                       std::pair{pade::live::PoseOf::camera, std::string_view("camera")}};
};
