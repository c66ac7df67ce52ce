// What a live session maps, as an MCAP file that `pade map` makes the same map of.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "pade/core/result.hpp"
#include "pade/io/recording/recording_writer.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// Writes in a thread of its own. Images are those that were mapped: undistorted, uncompressed.
class SessionRecorder : public InputSink {
 public:
  /// Errors: those of io::create_recording. An earlier recording of that name is replaced.
  /// @param mask  of the session; empty: all valid
  static Result<std::unique_ptr<SessionRecorder>> create(const std::filesystem::path& file,
                                                         const Camera& camera, const cv::Mat& mask);
  SessionRecorder(const SessionRecorder&) = delete;
  SessionRecorder& operator=(const SessionRecorder&) = delete;
  ~SessionRecorder() override;

  /// Never waits: where the disk does not follow, frames are left out and counted.
  void take(const MapperInput& input) override;
  /// The frames from here on go to another file: NAME-2.mcap, and so on.
  void begin_anew() override;

  /// Waits until all is written and the file has its name. Errors: something could not be written; nothing
  /// was recorded.
  Status finish();
  /// Frames that the disk was too slow for; with one of them missing the recording makes another map.
  [[nodiscard]] std::size_t left_out() const;
  /// The file of the last map.
  [[nodiscard]] std::filesystem::path file() const;

 private:
  SessionRecorder(std::filesystem::path file, const Camera& camera, const cv::Mat& mask);
  Status open();
  Status end();
  Status write(const MapperInput& input);
  Status write_mask(Time time);
  void run();

  std::filesystem::path first_file_;
  Camera camera_;
  cv::Mat mask_;
  mutable std::mutex mutex_;
  std::condition_variable come_;
  std::deque<std::unique_ptr<MapperInput>> waiting_;  // null: a new file begins
  std::unique_ptr<io::RecordingWriter> writer_;       // of the thread
  std::size_t part_ = 1, written_ = 0, left_out_ = 0;
  bool over_ = false;
  Status status_;
  std::thread thread_;
};

}  // namespace pade::live
