// Recordings of ROS: topics with stamped messages in one file, whichever of rosbag 2.0, MCAP and rosbag2's
// SQLite it is. What is in the messages is told by messages.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"

namespace pade::io {

/// Where a message lies: what that means, the reader of the format knows.
struct MessagePlace {
  Time time;                 ///< when it was recorded
  std::uint32_t block = 0;   ///< part of the file that is decompressed as a whole
  std::uint64_t offset = 0;  ///< in it
  std::uint64_t size = 0;    ///< bytes
};

/// What messages of one kind were sent under one name.
struct Topic {
  std::string name;
  std::string type;      ///< "sensor_msgs/Image": the "msg/" of ROS 2 is left out
  std::string encoding;  ///< how its messages are written: "ros1", "cdr", or another one as the file has it
  std::vector<MessagePlace> messages;  ///< in the order of their times
};

/// Later moments are refused, so that the difference of any two fits: the year 2115.
inline constexpr std::int64_t kLastTime = 4'600'000'000'000'000'000;

/// Knows where bytes of messages are. Any thread.
class MessageSource {
 public:
  MessageSource() = default;
  MessageSource(const MessageSource&) = delete;
  MessageSource& operator=(const MessageSource&) = delete;
  virtual ~MessageSource() = default;
  [[nodiscard]] virtual Result<std::string> read(const MessagePlace& place, std::size_t most) const = 0;
};

/// A recording that was read through once, so that damage is known before its messages are used. Of its
/// messages only the places are kept.
class Recording {
 public:
  /// Errors: no recording; damage, with the byte where it was found. A recording that was cut off is read as
  /// far as it goes, which remarks() says.
  /// @param path  a file, or the folder in which rosbag2 keeps one
  static Result<Recording> open(const std::filesystem::path& path);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] const std::string& format() const { return format_; }  ///< "rosbag 2.0", "MCAP", "rosbag2"
  [[nodiscard]] const std::vector<Topic>& topics() const { return topics_; }  ///< by name
  [[nodiscard]] const std::vector<std::string>& remarks() const { return remarks_; }
  /// The bytes of a message, the first `most` of them. Any thread.
  [[nodiscard]] Result<std::string> read(const MessagePlace& place,
                                         std::size_t most = static_cast<std::size_t>(-1)) const {
    return source_->read(place, most);
  }

  /// What the reader of a format finds; used by them.
  struct Content {
    std::string format;
    std::vector<Topic> topics;
    std::vector<std::string> remarks;
    std::unique_ptr<MessageSource> source;
  };

 private:
  std::filesystem::path file_;
  std::string format_;
  std::vector<Topic> topics_;
  std::vector<std::string> remarks_;
  std::unique_ptr<MessageSource> source_;
};

/// Whether Recording::open is the one to ask: by the first bytes of a file, or a folder with metadata.yaml
/// and a recording in it.
bool is_recording(const std::filesystem::path& path);

/// What to do about a folder that holds recordings and is none: without metadata.yaml, or compressed as a
/// whole. Empty if it holds none.
std::optional<std::string> why_no_recording(const std::filesystem::path& folder);

/// @{
/// The readers of the formats; `file` stands in messages.
Result<Recording::Content> read_bag(const std::filesystem::path& file);
Result<Recording::Content> read_mcap(const std::filesystem::path& file);
Result<Recording::Content> read_rosbag2(const std::filesystem::path& file);
/// @}

}  // namespace pade::io
