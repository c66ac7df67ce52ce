#include "pade/live/mavlink/frame.hpp"

#include "pade/live/mavlink/checksum.hpp"
#include "pade/live/mavlink/known_messages.hpp"

namespace pade::live::mavlink {
namespace {

constexpr std::size_t kHeader1 = 6;
constexpr std::size_t kHeader2 = 10;
constexpr std::size_t kChecksum = 2;
constexpr std::size_t kSignature = 13;
constexpr std::uint8_t kSigned = 0x01;  // the one flag that must be understood

bool plausible_length(const KnownMessage& message, const Frame& frame, std::size_t payload) {
  if (frame.version == 1) return payload == message.base_length;
  return payload >= 1 && payload <= message.length;
}

void read_header(std::span<const std::uint8_t> b, Frame& frame) {
  const std::size_t at = frame.version == 1 ? 2 : 4;  // of the sequence number
  frame.sequence = b[at];
  frame.system = b[at + 1];
  frame.component = b[at + 2];
  frame.id = b[at + 3];
  if (frame.version == 2) {
    frame.id |= static_cast<std::uint32_t>(b[at + 4]) << 8U | static_cast<std::uint32_t>(b[at + 5]) << 16U;
  }
}

}  // namespace

Look look(std::span<const std::uint8_t> bytes) {
  Look result;
  if (bytes.empty() || (bytes[0] != kStart1 && bytes[0] != kStart2)) return result;
  Frame& frame = result.frame;
  frame.version = bytes[0] == kStart1 ? 1 : 2;
  if (frame.version == 2 && bytes.size() > 2 && (bytes[2] & ~kSigned) != 0) return result;
  const std::size_t header = frame.version == 1 ? kHeader1 : kHeader2;
  if (bytes.size() < header) {
    result.found = Found::incomplete;
    return result;
  }
  const std::size_t payload = bytes[1];
  frame.is_signed = frame.version == 2 && (bytes[2] & kSigned) != 0;
  read_header(bytes, frame);
  result.length = header + payload + kChecksum + (frame.is_signed ? kSignature : 0);
  const KnownMessage* const message = known_message(frame.id);
  if (message == nullptr) {
    result.found = Found::unknown;
    return result;
  }
  if (!plausible_length(*message, frame, payload)) return result;
  if (bytes.size() < result.length) {
    result.found = Found::incomplete;
    return result;
  }
  Checksum checksum;
  for (const std::uint8_t byte : bytes.subspan(1, header + payload - 1)) checksum.add(byte);
  checksum.add(message->crc_extra);
  const auto stated = static_cast<unsigned>(bytes[header + payload]) |
                      static_cast<unsigned>(bytes[header + payload + 1]) << 8U;
  if (stated != checksum.value()) {
    result.found = Found::bad_checksum;
    return result;
  }
  result.found = Found::frame;
  frame.payload = bytes.subspan(header, payload);
  frame.bytes = bytes.first(result.length);
  return result;
}

}  // namespace pade::live::mavlink
