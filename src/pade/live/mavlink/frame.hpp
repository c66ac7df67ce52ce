// One packet of MAVLink 1 or 2 in bytes, found and checked (https://mavlink.io/en/guide/serialization.html).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace pade::live::mavlink {

inline constexpr std::uint8_t kStart1 = 0xfe;             ///< first byte of a packet of MAVLink 1
inline constexpr std::uint8_t kStart2 = 0xfd;             ///< and of MAVLink 2
inline constexpr std::size_t kLongestFrame = 280;         ///< header, payload, checksum and signature, bytes
inline constexpr std::uint8_t kAutopilotComponent = 1;    ///< MAV_COMP_ID_AUTOPILOT1
inline constexpr std::uint8_t kAvoidanceComponent = 196;  ///< MAV_COMP_ID_OBSTACLE_AVOIDANCE

inline constexpr std::uint8_t kNoAutopilot = 8;  ///< MAV_AUTOPILOT_INVALID: who sends it flies nothing

/// A packet whose checksum is right. It points into the bytes that it was found in.
struct Frame {
  std::uint32_t id = 0;                   ///< of the message
  std::uint8_t version = 2;               ///< 1 or 2
  std::uint8_t sequence = 0;              ///< counts the packets of this sender
  std::uint8_t system = 0;                ///< sender
  std::uint8_t component = 0;             ///< part of it
  bool is_signed = false;                 ///< the signature is not checked
  std::span<const std::uint8_t> payload;  ///< without the zeros that MAVLink 2 leaves out
  std::span<const std::uint8_t> bytes;    ///< the whole packet
};

/// What stands at the beginning of some bytes.
enum class Found : std::uint8_t {
  frame,         ///< a packet
  incomplete,    ///< what may become one when more bytes come
  nothing,       ///< no header of a packet
  unknown,       ///< a header whose message no definition has: nothing can be checked
  bad_checksum,  ///< a header, and bytes that do not fit it
};

/// A look at the beginning of some bytes.
struct Look {
  Found found = Found::nothing;
  Frame frame;             ///< if there is one; of an unknown message the header alone
  std::size_t length = 0;  ///< of the packet that the header announces, bytes
};

/// Whether a packet begins with the first byte. Refuses headers with lengths and flags that cannot be before
/// their end has come, so that few bytes are waited for in vain.
Look look(std::span<const std::uint8_t> bytes);

}  // namespace pade::live::mavlink
