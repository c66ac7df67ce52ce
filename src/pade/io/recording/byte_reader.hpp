// Numbers and texts out of bytes, in order. Reading beyond the end gives zeros and is remembered.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace pade::io {

class ByteReader {
 public:
  /// @param big_endian  numbers have their highest byte first
  explicit ByteReader(std::string_view bytes, bool big_endian = false)
      : bytes_(bytes), swapped_(big_endian != (std::endian::native == std::endian::big)) {}

  template <class Number>
  Number number() {
    std::array<char, sizeof(Number)> raw{};
    const std::string_view found = take(sizeof(Number));
    std::copy(found.begin(), found.end(), raw.begin());
    if (swapped_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<Number>(raw);
  }
  /// The next `count` bytes; none where there are fewer.
  std::string_view take(std::size_t count) {
    if (count > left()) {
      failed_ = true;
      at_ = bytes_.size();
      return {};
    }
    const std::string_view part = bytes_.substr(at_, count);
    at_ += count;
    return part;
  }
  /// Bytes behind their number (32 bits).
  std::string_view counted() { return take(number<std::uint32_t>()); }

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool swapped_;
  bool failed_ = false;
};

}  // namespace pade::io
