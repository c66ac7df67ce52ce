// The checksum of MAVLink: CRC-16/MCRF4XX, which the protocol calls X.25.
#pragma once

#include <cstdint>

namespace pade::live::mavlink {

/// A running checksum.
class Checksum {
 public:
  constexpr void add(std::uint8_t byte) {
    auto folded = static_cast<std::uint8_t>(byte ^ (value_ & 0xffU));
    folded = static_cast<std::uint8_t>(folded ^ (folded << 4U));
    value_ = static_cast<std::uint16_t>((value_ >> 8U) ^ (folded << 8U) ^ (folded << 3U) ^ (folded >> 4U));
  }
  [[nodiscard]] constexpr std::uint16_t value() const { return value_; }

 private:
  std::uint16_t value_ = 0xffff;
};

}  // namespace pade::live::mavlink
