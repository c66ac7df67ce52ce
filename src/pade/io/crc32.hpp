// The checksum of PNG and MCAP (ISO 3309, polynomial EDB88320).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pade::io {

namespace crc32_detail {
constexpr std::array<std::uint32_t, 256> table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
    table[i] = c;
  }
  return table;
}
inline constexpr std::array<std::uint32_t, 256> kTable = table();
}  // namespace crc32_detail

/// Over bytes that come piece by piece.
class Crc32 {
 public:
  void add(const void* bytes, std::size_t count) {
    const auto* const p = static_cast<const std::uint8_t*>(bytes);
    for (std::size_t i = 0; i < count; ++i)
      state_ = crc32_detail::kTable[(state_ ^ p[i]) & 0xFFU] ^ (state_ >> 8);
  }
  [[nodiscard]] std::uint32_t value() const { return state_ ^ 0xFFFFFFFFU; }

 private:
  std::uint32_t state_ = 0xFFFFFFFFU;
};

inline std::uint32_t crc32(const void* bytes, std::size_t count) {
  Crc32 crc;
  crc.add(bytes, count);
  return crc.value();
}

}  // namespace pade::io
