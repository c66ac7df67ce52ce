// What a live session maps, as an MCAP file that `pade map` makes the same map of.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/recording/recording_writer.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// When a recording ends so that the map still finds room on the disk.
struct RecorderLimits {
  std::uintmax_t least_space = 500'000'000;  ///< bytes that are left free
  /// Of the file system that a file is to lie on, bytes.
  std::function<std::uintmax_t(const std::filesystem::path& file)> available = space_beside;

  static std::uintmax_t space_beside(const std::filesystem::path& file);
};

/// How a recording is.
struct RecorderReport {
  std::size_t left_out = 0;          ///< frames that the file lacks: with one missing it makes another map
  std::string ended;                 ///< why nothing more is recorded; empty: all is well
  std::vector<std::string> earlier;  ///< files of earlier sessions, as they are called now
  std::filesystem::path file;        ///< of the last map
};

/// Writes in a thread of its own, never over anything: what an earlier session has recorded, or begun to, is
/// kept under the first free number (NAME-1.mcap, NAME-1.mcap.part, ...). Images are those that were mapped:
/// undistorted, uncompressed.
class SessionRecorder : public InputSink {
 public:
  /// Errors: those of io::create_recording; an earlier recording of that name cannot be moved.
  /// @param mask  of the session; empty: all valid
  static Result<std::unique_ptr<SessionRecorder>> create(const std::filesystem::path& file,
                                                         const Camera& camera, const cv::Mat& mask,
                                                         const RecorderLimits& limits = {});
  SessionRecorder(const SessionRecorder&) = delete;
  SessionRecorder& operator=(const SessionRecorder&) = delete;
  ~SessionRecorder() override;

  /// Never waits: where the disk does not follow, frames are left out and counted.
  void take(const MapperInput& input) override;
  /// The frames from here on go to another file: NAME-2.mcap, or the next number that is free.
  void begin_anew() override;

  /// Waits until all is written and the file has its name. Errors: something could not be written; nothing
  /// was recorded.
  Status finish();
  [[nodiscard]] RecorderReport report() const;

 private:
  SessionRecorder(std::filesystem::path file, const Camera& camera, const cv::Mat& mask,
                  const RecorderLimits& limits);
  [[nodiscard]] std::filesystem::path free_name(int from) const;
  Status keep_earlier();
  Status open(const std::filesystem::path& file);
  void end_for_want_of_space();
  void fail(const Status& status);
  Status end();
  Status write(const MapperInput& input);
  Status write_mask(Time time);
  void run();

  std::filesystem::path first_file_, last_file_;
  Camera camera_;
  cv::Mat mask_;
  mutable std::mutex mutex_;
  std::condition_variable come_;
  std::deque<std::unique_ptr<MapperInput>> waiting_;  // null: a new file begins
  std::unique_ptr<io::RecordingWriter> writer_;       // of the thread
  std::size_t written_ = 0, finished_ = 0;            // frames of this file; files
  RecorderLimits limits_;
  RecorderReport report_;
  bool over_ = false;
  Status status_;
  std::thread thread_;
};

}  // namespace pade::live
