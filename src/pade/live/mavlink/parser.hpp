// Packets out of a stream of bytes that begins anywhere, loses bytes and has wrong ones in it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pade/live/mavlink/frame.hpp"

namespace pade::live::mavlink {

/// What came over a link.
struct LinkCounts {
  std::uint64_t packets = 0;        ///< with a right checksum
  std::uint64_t bad = 0;            ///< headers whose checksum was wrong
  std::uint64_t unknown = 0;        ///< headers of messages that no definition has
  std::uint64_t gaps = 0;           ///< places where numbers of a sender are missing
  std::uint64_t lost = 0;           ///< numbers missing there, as far as 8 bits tell
  std::uint64_t skipped_bytes = 0;  ///< between packets
};

/// Watches the numbers of the packets, sender by sender.
class SequenceWatch {
 public:
  /// Counts packet, gap and what is lost. At most 32 senders are watched; the packets of others are counted.
  void add(const Frame& frame, LinkCounts& counts);
  /// An unknown message cannot be checked, but if it has the number that is due, that number is not missing.
  void pass(const Frame& header);

 private:
  struct Source {
    std::uint8_t system = 0;
    std::uint8_t component = 0;
    std::uint8_t due = 0;  ///< next number
  };
  Source* find(const Frame& frame);

  std::array<Source, 32> sources_{};
  std::size_t count_ = 0;
};

/// One for each link. No allocation; bytes are looked at a bounded number of times.
class Parser {
 public:
  /// Calls `take(const Frame&)` for each packet; the frame is valid during the call.
  template <class Take>
  void add(std::span<const std::uint8_t> bytes, Take&& take) {
    while (!bytes.empty()) {
      make_room();
      const std::size_t count = std::min(bytes.size(), buffer_.size() - end_);
      std::copy_n(bytes.begin(), count, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
      end_ += count;
      bytes = bytes.subspan(count);
      Frame frame;
      while (next(frame)) take(static_cast<const Frame&>(frame));
    }
  }
  [[nodiscard]] const LinkCounts& counts() const { return counts_; }
  /// Bytes of the stream before the packet that is being taken.
  [[nodiscard]] std::uint64_t position() const { return position_; }

 private:
  void make_room();
  bool next(Frame& frame);

  std::array<std::uint8_t, 4 * kLongestFrame> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  // of what is not yet looked at
  std::uint64_t consumed_ = 0;       // bytes of the stream before begin_
  std::uint64_t position_ = 0;
  LinkCounts counts_;
  SequenceWatch watch_;
};

}  // namespace pade::live::mavlink
