// Messages to bytes and back, by the table that each has (layout.hpp). No allocation, no exception.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>

#include "pade/live/mavlink/checksum.hpp"
#include "pade/live/mavlink/frame.hpp"
#include "pade/live/mavlink/layout.hpp"

namespace pade::live::mavlink {

static_assert(std::endian::native == std::endian::little, "the fields of MAVLink are little-endian");

/// A packet on its way out.
struct Packet {
  std::array<std::uint8_t, kLongestFrame> bytes{};
  std::size_t length = 0;  ///< of them, bytes

  [[nodiscard]] std::span<const std::uint8_t> span() const { return std::span(bytes).first(length); }
};

/// Who sends, and the number of the next packet.
struct Sender {
  std::uint8_t system = 1;
  std::uint8_t component = kAvoidanceComponent;
  std::uint8_t sequence = 0;  ///< counts up with each packet
};

namespace detail {

template <std::size_t n>
class WriteFields {
 public:
  WriteFields(const std::array<FieldLayout, n>& fields, std::uint8_t* payload)
      : fields_(fields), payload_(payload) {}
  template <class T>
  void operator()(std::string_view /*name*/, const T& value, Extension /*tag*/ = {}) {
    std::memcpy(payload_ + fields_[next_++].offset, &value, sizeof(T));
  }

 private:
  const std::array<FieldLayout, n>& fields_;
  std::uint8_t* payload_;
  std::size_t next_ = 0;
};

template <std::size_t n>
class ReadFields {
 public:
  ReadFields(const std::array<FieldLayout, n>& fields, const std::uint8_t* payload)
      : fields_(fields), payload_(payload) {}
  template <class T>
  void operator()(std::string_view /*name*/, T& value, Extension /*tag*/ = {}) {
    std::memcpy(&value, payload_ + fields_[next_++].offset, sizeof(T));
  }

 private:
  const std::array<FieldLayout, n>& fields_;
  const std::uint8_t* payload_;
  std::size_t next_ = 0;
};

}  // namespace detail

/// A message of MAVLink 2 as a packet: zeros at its end are left out, but for the first byte.
template <class Message>
Packet pack(const Message& message, Sender& sender) {
  constexpr MessageLayout layout = layout_of<Message>();
  static constexpr auto fields = fields_of<Message>();
  static_assert(layout.length <= 255);
  Packet packet;
  std::uint8_t* const b = packet.bytes.data();
  Message::visit(message, detail::WriteFields(fields, b + 10));
  std::size_t length = layout.length;
  while (length > 1 && b[9 + length] == 0) --length;
  b[0] = kStart2;
  b[1] = static_cast<std::uint8_t>(length);
  b[4] = sender.sequence++;
  b[5] = sender.system;
  b[6] = sender.component;
  b[7] = Message::kId & 0xffU;
  b[8] = Message::kId >> 8U & 0xffU;
  b[9] = Message::kId >> 16U & 0xffU;
  packet.length = 10 + length;
  Checksum checksum;
  for (std::size_t i = 1; i < packet.length; ++i) checksum.add(b[i]);
  checksum.add(layout.crc_extra);
  b[packet.length++] = static_cast<std::uint8_t>(checksum.value() & 0xffU);
  b[packet.length++] = static_cast<std::uint8_t>(static_cast<unsigned>(checksum.value()) >> 8U);
  return packet;
}

/// The message of a packet; bytes that it does not have are 0. Empty if it is another message.
template <class Message>
std::optional<Message> unpack(const Frame& frame) {
  constexpr MessageLayout layout = layout_of<Message>();
  static constexpr auto fields = fields_of<Message>();
  if (frame.id != Message::kId) return std::nullopt;
  std::array<std::uint8_t, layout.length> payload{};
  const std::size_t length = std::min(frame.payload.size(), layout.length);
  std::copy_n(frame.payload.begin(), length, payload.begin());
  Message message;
  Message::visit(message, detail::ReadFields(fields, payload.data()));
  return message;
}

}  // namespace pade::live::mavlink
