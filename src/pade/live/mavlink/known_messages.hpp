// What guards the messages that autopilots send, also those that nobody here reads: without its CRC_EXTRA the
// checksum of a message cannot be told right from wrong.
#pragma once

#include <cstdint>
#include <string_view>

namespace pade::live::mavlink {

/// One message of the definitions.
struct KnownMessage {
  std::uint32_t id = 0;
  std::uint8_t crc_extra = 0;
  std::uint8_t base_length = 0;  ///< payload of MAVLink 1, bytes
  std::uint8_t length = 0;       ///< with the extensions of MAVLink 2, bytes
  std::string_view name;         ///< as in the definition
};

/// Null if no definition that we know has this number.
const KnownMessage* known_message(std::uint32_t id);

}  // namespace pade::live::mavlink
