// Recordings of ROS written: rosbag 2.0 and MCAP.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {

/// A file beside its place, NAME.part, until it is done: then it gets its name. What is abandoned is removed,
/// unless it is to be kept; then a power cut does not take it either, but for the last second before flush().
class PartialFile {
 public:
  static Result<PartialFile> create(const std::filesystem::path& target, Overwrite overwrite, bool keep);
  PartialFile(PartialFile&& other) noexcept;
  PartialFile& operator=(PartialFile&&) = delete;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  ~PartialFile();

  void append(std::string_view bytes);
  /// Over what is there already.
  void overwrite(std::uint64_t at, std::string_view bytes);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Writes out what is held back. Error if anything could not be written.
  Status flush();
  Status commit();

 private:
  PartialFile() = default;
  std::filesystem::path target_, place_;
  std::ofstream stream_;
  std::uint64_t size_ = 0;
  bool keep_ = false;
  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
};

/// Writes messages, chunk by chunk. Topics are told apart by their names.
class RecordingWriter {
 public:
  RecordingWriter() = default;
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  virtual ~RecordingWriter() = default;

  /// How its messages are to be encoded.
  [[nodiscard]] virtual MessageEncoding encoding() const = 0;
  /// @param type     one that message_definition() knows
  /// @param message  in encoding()
  virtual Status write(std::string_view topic, std::string_view type, Time time,
                       std::string_view message) = 0;
  /// Puts what was written so far where a reader finds it after a crash.
  virtual Status flush() = 0;
  /// Index and end; the file gets its name.
  virtual Status finish() = 0;
};

/// By the ending of its name: .bag or .mcap. Errors: another ending; it exists and is not to be replaced; it
/// cannot be written.
/// @param keep  what was not finished stays as NAME.part
Result<std::unique_ptr<RecordingWriter>> create_recording(const std::filesystem::path& file,
                                                          Overwrite overwrite, bool keep = false);

/// @{
/// The writers of the formats.
std::unique_ptr<RecordingWriter> bag_writer(PartialFile file);
std::unique_ptr<RecordingWriter> mcap_writer(PartialFile file);
/// @}

}  // namespace pade::io
