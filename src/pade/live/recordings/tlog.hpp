// Recordings of ground stations (.tlog): packets of MAVLink, each behind the time at which it arrived (64
// bits, microseconds since 1970, the highest byte first).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/core/time.hpp"
#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/mavlink/parser.hpp"

namespace pade::live {

/// By its name.
bool is_tlog(const std::filesystem::path& file);

/// A packet of a recording.
struct TlogPacket {
  mavlink::Frame frame;
  Time arrival;              ///< since 1970; its spread against the autopilot's own stamps can be seconds
  std::size_t position = 0;  ///< of its first byte in the file
};

/// Calls `take` for each packet whose checksum is right, in the order of the file. Where bytes are damaged,
/// the next packet is looked for byte by byte.
mavlink::LinkCounts for_each_packet(std::span<const std::uint8_t> bytes,
                                    const std::function<void(const TlogPacket&)>& take);

/// One kind of message of one sender.
struct MessageCount {
  std::uint8_t system = 0;
  std::uint8_t component = 0;
  std::uint32_t id = 0;
  std::string name;       ///< as in the definition
  std::size_t count = 0;  ///< packets
};

/// What is in a recording.
struct TlogSummary {
  mavlink::LinkCounts counts;
  std::uint8_t version = 0;            ///< of the packets: 1, 2, or 3 for both
  Time first, last;                    ///< arrival
  std::vector<MessageCount> messages;  ///< by sender, then number
  std::optional<Autopilot> autopilot;  ///< who sent most heartbeats of one; empty if nobody did
  BootClock clock;                     ///< by the last SYSTEM_TIME of it
};

/// Errors: the file cannot be read, or holds no packet.
Result<std::vector<std::uint8_t>> read_tlog(const std::filesystem::path& file);
TlogSummary summarise(std::span<const std::uint8_t> bytes);

/// The sensors of a recording's autopilot. Errors: those of read_tlog; nobody who flies; a sensor is missing
/// (SensorGatherer::log).
Result<NavigationLog> read_tlog_sensors(const std::filesystem::path& file,
                                        SensorNeed need = SensorNeed::imu_and_gnss);

}  // namespace pade::live
