// What an autopilot believes of its own motion.
//
// Names, units and order are those of MAVLink's common.xml (and of ardupilotmega.xml from id 11000 on);
// `visit` is the message's one table. Frames on the wire are forward-right-down and north-east-down.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "pade/live/mavlink/layout.hpp"

namespace pade::live::mavlink {

/// The autopilot's attitude as angles.
struct Attitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  std::uint32_t time_boot_ms = 0;  ///< ms
  float roll = 0;                  ///< rad
  float pitch = 0;                 ///< rad
  float yaw = 0;                   ///< rad
  float rollspeed = 0;             ///< rad/s
  float pitchspeed = 0;            ///< rad/s
  float yawspeed = 0;              ///< rad/s

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("roll", self.roll);
    field("pitch", self.pitch);
    field("yaw", self.yaw);
    field("rollspeed", self.rollspeed);
    field("pitchspeed", self.pitchspeed);
    field("yawspeed", self.yawspeed);
  }
};

/// The same as a quaternion: north-east-down from forward-right-down.
struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  std::uint32_t time_boot_ms = 0;  ///< ms
  float q1 = 0;                    ///< w
  float q2 = 0;                    ///< x
  float q3 = 0;                    ///< y
  float q4 = 0;                    ///< z
  float rollspeed = 0;             ///< rad/s
  float pitchspeed = 0;            ///< rad/s
  float yawspeed = 0;              ///< rad/s
  std::array<float, 4> repr_offset_q{};

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("q1", self.q1);
    field("q2", self.q2);
    field("q3", self.q3);
    field("q4", self.q4);
    field("rollspeed", self.rollspeed);
    field("pitchspeed", self.pitchspeed);
    field("yawspeed", self.yawspeed);
    field("repr_offset_q", self.repr_offset_q, kExtension);
  }
};

/// The autopilot's position and velocity, north, east, down of its origin.
struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  std::uint32_t time_boot_ms = 0;  ///< ms
  float x = 0;                     ///< m
  float y = 0;                     ///< m
  float z = 0;                     ///< m
  float vx = 0;                    ///< m/s
  float vy = 0;                    ///< m/s
  float vz = 0;                    ///< m/s

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("x", self.x);
    field("y", self.y);
    field("z", self.z);
    field("vx", self.vx);
    field("vy", self.vy);
    field("vz", self.vz);
  }
};

/// The same on the globe.
struct GlobalPositionInt {
  static constexpr std::uint32_t kId = 33;
  static constexpr std::string_view kName = "GLOBAL_POSITION_INT";
  std::uint32_t time_boot_ms = 0;  ///< ms
  std::int32_t lat = 0;            ///< 1e-7 degrees
  std::int32_t lon = 0;            ///< 1e-7 degrees
  std::int32_t alt = 0;            ///< mm
  std::int32_t relative_alt = 0;   ///< mm
  std::int16_t vx = 0;             ///< cm/s
  std::int16_t vy = 0;             ///< cm/s
  std::int16_t vz = 0;             ///< cm/s
  std::uint16_t hdg = 0;           ///< 0.01 degrees

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("lat", self.lat);
    field("lon", self.lon);
    field("alt", self.alt);
    field("relative_alt", self.relative_alt);
    field("vx", self.vx);
    field("vy", self.vy);
    field("vz", self.vz);
    field("hdg", self.hdg);
  }
};

/// Where the origin of the local frame lies.
struct GpsGlobalOrigin {
  static constexpr std::uint32_t kId = 49;
  static constexpr std::string_view kName = "GPS_GLOBAL_ORIGIN";
  std::int32_t latitude = 0;    ///< 1e-7 degrees
  std::int32_t longitude = 0;   ///< 1e-7 degrees
  std::int32_t altitude = 0;    ///< mm
  std::uint64_t time_usec = 0;  ///< µs

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("latitude", self.latitude);
    field("longitude", self.longitude);
    field("altitude", self.altitude);
    field("time_usec", self.time_usec, kExtension);
  }
};

/// Pose and velocity with covariance.
struct Odometry {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::string_view kName = "ODOMETRY";
  std::uint64_t time_usec = 0;                  ///< µs
  std::uint8_t frame_id = 0;                    ///< MAV_FRAME of the pose
  std::uint8_t child_frame_id = 0;              ///< MAV_FRAME of the velocity
  float x = 0;                                  ///< m
  float y = 0;                                  ///< m
  float z = 0;                                  ///< m
  std::array<float, 4> q{};                     ///< w x y z
  float vx = 0;                                 ///< m/s
  float vy = 0;                                 ///< m/s
  float vz = 0;                                 ///< m/s
  float rollspeed = 0;                          ///< rad/s
  float pitchspeed = 0;                         ///< rad/s
  float yawspeed = 0;                           ///< rad/s
  std::array<float, 21> pose_covariance{};      ///< upper triangle by rows; NaN: unknown
  std::array<float, 21> velocity_covariance{};  ///< the same
  std::uint8_t reset_counter = 0;               ///< counts the jumps of the estimate
  std::uint8_t estimator_type = 0;
  std::int8_t quality = 0;  ///< percent; -1: failed, 0: unknown

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("frame_id", self.frame_id);
    field("child_frame_id", self.child_frame_id);
    field("x", self.x);
    field("y", self.y);
    field("z", self.z);
    field("q", self.q);
    field("vx", self.vx);
    field("vy", self.vy);
    field("vz", self.vz);
    field("rollspeed", self.rollspeed);
    field("pitchspeed", self.pitchspeed);
    field("yawspeed", self.yawspeed);
    field("pose_covariance", self.pose_covariance);
    field("velocity_covariance", self.velocity_covariance);
    field("reset_counter", self.reset_counter, kExtension);
    field("estimator_type", self.estimator_type, kExtension);
    field("quality", self.quality, kExtension);
  }
};
}  // namespace pade::live::mavlink
