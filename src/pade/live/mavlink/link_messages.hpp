// What goes both ways: heartbeat, clock, orders, text, obstacles.
//
// Names, units and order are those of MAVLink's common.xml (and of ardupilotmega.xml from id 11000 on);
// `visit` is the message's one table. Frames on the wire are forward-right-down and north-east-down.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "pade/live/mavlink/layout.hpp"

namespace pade::live::mavlink {

/// Who is there, and how it is.
struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint8_t type = 0;       ///< MAV_TYPE
  std::uint8_t autopilot = 0;  ///< MAV_AUTOPILOT; 8: none
  std::uint8_t base_mode = 0;
  std::uint32_t custom_mode = 0;
  std::uint8_t system_status = 0;    ///< MAV_STATE
  std::uint8_t mavlink_version = 0;  ///< 3

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("type", self.type);
    field("autopilot", self.autopilot);
    field("base_mode", self.base_mode);
    field("custom_mode", self.custom_mode);
    field("system_status", self.system_status);
    field("mavlink_version", self.mavlink_version);
  }
};

/// An order to the autopilot.
struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;
  std::uint16_t command = 0;  ///< MAV_CMD
  std::uint8_t confirmation = 0;
  float param1 = 0;
  float param2 = 0;
  float param3 = 0;
  float param4 = 0;
  float param5 = 0;
  float param6 = 0;
  float param7 = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("target_system", self.target_system);
    field("target_component", self.target_component);
    field("command", self.command);
    field("confirmation", self.confirmation);
    field("param1", self.param1);
    field("param2", self.param2);
    field("param3", self.param3);
    field("param4", self.param4);
    field("param5", self.param5);
    field("param6", self.param6);
    field("param7", self.param7);
  }
};

/// Its answer.
struct CommandAck {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::string_view kName = "COMMAND_ACK";
  std::uint16_t command = 0;  ///< MAV_CMD
  std::uint8_t result = 0;    ///< MAV_RESULT; 0: accepted
  std::uint8_t progress = 0;
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("command", self.command);
    field("result", self.result);
    field("progress", self.progress, kExtension);
    field("result_param2", self.result_param2, kExtension);
    field("target_system", self.target_system, kExtension);
    field("target_component", self.target_component, kExtension);
  }
};

/// Question (tc1 = 0) and answer about the clock.
struct Timesync {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::string_view kName = "TIMESYNC";
  std::int64_t tc1 = 0;  ///< clock of who answers, ns; 0 in a question
  std::int64_t ts1 = 0;  ///< clock of who asks, ns
  std::uint8_t target_system = 0;
  std::uint8_t target_component = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("tc1", self.tc1);
    field("ts1", self.ts1);
    field("target_system", self.target_system, kExtension);
    field("target_component", self.target_component, kExtension);
  }
};

/// A line for the pilot.
struct StatusText {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::string_view kName = "STATUSTEXT";
  std::uint8_t severity = 0;    ///< MAV_SEVERITY: 4 warning, 6 information
  std::array<char, 50> text{};  ///< ends with 0 if shorter
  std::uint16_t id = 0;
  std::uint8_t chunk_seq = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("severity", self.severity);
    field("text", self.text);
    field("id", self.id, kExtension);
    field("chunk_seq", self.chunk_seq, kExtension);
  }
};

/// Distances around the vehicle.
struct ObstacleDistance {
  static constexpr std::uint32_t kId = 330;
  static constexpr std::string_view kName = "OBSTACLE_DISTANCE";
  std::uint64_t time_usec = 0;                ///< µs
  std::uint8_t sensor_type = 0;               ///< MAV_DISTANCE_SENSOR; 4: unknown
  std::array<std::uint16_t, 72> distances{};  ///< cm; max_distance + 1: free; 65535: unknown
  std::uint8_t increment = 0;                 ///< degrees
  std::uint16_t min_distance = 0;             ///< cm
  std::uint16_t max_distance = 0;             ///< cm
  float increment_f = 0;                      ///< degrees; 0: as increment says
  float angle_offset = 0;                     ///< degrees
  std::uint8_t frame = 0;                     ///< MAV_FRAME; 12: body

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("sensor_type", self.sensor_type);
    field("distances", self.distances);
    field("increment", self.increment);
    field("min_distance", self.min_distance);
    field("max_distance", self.max_distance);
    field("increment_f", self.increment_f, kExtension);
    field("angle_offset", self.angle_offset, kExtension);
    field("frame", self.frame, kExtension);
  }
};

/// How the companion computer is.
struct OnboardComputerStatus {
  static constexpr std::uint32_t kId = 390;
  static constexpr std::string_view kName = "ONBOARD_COMPUTER_STATUS";
  std::uint64_t time_usec = 0;  ///< µs
  std::uint32_t uptime = 0;     ///< ms
  std::uint8_t type = 0;
  std::array<std::uint8_t, 8> cpu_cores{};  ///< percent; 255: unknown
  std::array<std::uint8_t, 10> cpu_combined{};
  std::array<std::uint8_t, 4> gpu_cores{};
  std::array<std::uint8_t, 10> gpu_combined{};
  std::int8_t temperature_board = 0;  ///< °C
  std::array<std::int8_t, 8> temperature_core{};
  std::array<std::int16_t, 4> fan_speed{};
  std::uint32_t ram_usage = 0;  ///< MiB
  std::uint32_t ram_total = 0;  ///< MiB
  std::array<std::uint32_t, 4> storage_type{};
  std::array<std::uint32_t, 4> storage_usage{};
  std::array<std::uint32_t, 4> storage_total{};
  std::array<std::uint32_t, 6> link_type{};
  std::array<std::uint32_t, 6> link_tx_rate{};
  std::array<std::uint32_t, 6> link_rx_rate{};
  std::array<std::uint32_t, 6> link_tx_max{};
  std::array<std::uint32_t, 6> link_rx_max{};
  std::uint16_t status_flags = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_usec", self.time_usec);
    field("uptime", self.uptime);
    field("type", self.type);
    field("cpu_cores", self.cpu_cores);
    field("cpu_combined", self.cpu_combined);
    field("gpu_cores", self.gpu_cores);
    field("gpu_combined", self.gpu_combined);
    field("temperature_board", self.temperature_board);
    field("temperature_core", self.temperature_core);
    field("fan_speed", self.fan_speed);
    field("ram_usage", self.ram_usage);
    field("ram_total", self.ram_total);
    field("storage_type", self.storage_type);
    field("storage_usage", self.storage_usage);
    field("storage_total", self.storage_total);
    field("link_type", self.link_type);
    field("link_tx_rate", self.link_tx_rate);
    field("link_rx_rate", self.link_rx_rate);
    field("link_tx_max", self.link_tx_max);
    field("link_rx_max", self.link_rx_max);
    field("status_flags", self.status_flags, kExtension);
  }
};

/// One obstacle, for ArduPilot.
struct ObstacleDistance3d {
  static constexpr std::uint32_t kId = 11037;
  static constexpr std::string_view kName = "OBSTACLE_DISTANCE_3D";
  std::uint32_t time_boot_ms = 0;  ///< ms
  std::uint8_t sensor_type = 0;
  std::uint8_t frame = 0;         ///< MAV_FRAME
  std::uint16_t obstacle_id = 0;  ///< 65535: unknown
  float x = 0;                    ///< m
  float y = 0;                    ///< m
  float z = 0;                    ///< m
  float min_distance = 0;         ///< m
  float max_distance = 0;         ///< m

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& field) {
    field("time_boot_ms", self.time_boot_ms);
    field("sensor_type", self.sensor_type);
    field("frame", self.frame);
    field("obstacle_id", self.obstacle_id);
    field("x", self.x);
    field("y", self.y);
    field("z", self.z);
    field("min_distance", self.min_distance);
    field("max_distance", self.max_distance);
  }
};
}  // namespace pade::live::mavlink
