// One number for a lot of bytes: tells inputs apart; it is not cryptographic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace pade {

/// FNV-1a, 64 bit. The same on every machine for the same bytes.
class Fingerprint {
 public:
  void bytes(const void* data, std::size_t size) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ p[i]) * 0x100000001b3ULL;
  }
  /// Text and its end, so that "ab", "c" differs from "a", "bc".
  void text(std::string_view text) {
    bytes(text.data(), text.size());
    bytes("\0", 1);
  }
  void number(std::uint64_t value) {
    for (int shift = 0; shift < 64; shift += 8) {
      const auto byte = static_cast<unsigned char>(value >> shift);
      bytes(&byte, 1);
    }
  }

  [[nodiscard]] std::uint64_t value() const { return value_; }
  /// 16 hexadecimal digits.
  [[nodiscard]] std::string hex() const {
    static constexpr std::string_view digits = "0123456789abcdef";
    std::string text(16, '0');
    for (int i = 0; i < 16; ++i) text[static_cast<std::size_t>(i)] = digits[(value_ >> (60 - 4 * i)) & 15U];
    return text;
  }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace pade
