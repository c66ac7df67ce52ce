#include "pade/live/camera/video_source.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "pade/io/loaded_module.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/camera/video_clock.hpp"
#include "pade/live/camera/video_module.hpp"

namespace pade::live {
namespace {

Status check_size(const std::string& name, const cv::Mat& image, const Camera& camera) {
  if (image.cols == camera.width && image.rows == camera.height) return {};
  return Error{fmt::format("{}: gives {} x {}, expected the calibration's {} x {}", name, image.cols,
                           image.rows, camera.width, camera.height)};
}

/// A file at its real pace.
class VideoFileSource : public FrameSource {
 public:
  VideoFileSource(std::unique_ptr<Video> video, VideoFrame first, const Camera& camera)
      : video_(std::move(video)),
        calibrated_(camera),
        ideal_(camera.undistorted()),
        undistort_(camera),
        first_(first.seconds),
        ahead_(std::move(first)) {}

  Outcome next(LiveFrame& frame, int milliseconds) override {
    if (!ahead_ && !read_ahead()) return Outcome::ended;
    if (start_.nanoseconds == 0) start_ = now_of_ours();
    const Time due{start_.nanoseconds + static_cast<std::int64_t>(1e9 * (ahead_->seconds - first_))};
    const double wait = std::min(seconds_between(now_of_ours(), due), 1e-3 * milliseconds);
    if (wait > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait));
    if (now_of_ours() < due) return Outcome::nothing;
    frame = {undistort_(ahead_->image), due};
    ahead_.reset();
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return ideal_; }
  [[nodiscard]] cv::Mat mask() const override { return undistort_.valid(); }

 private:
  /// The next frame of the right size and in the order of time; false: there is none.
  bool read_ahead() {
    const double last = last_.value_or(first_);
    VideoFrame frame;
    while (true) {
      const Video::Read read = video_->next(frame);
      if (read == Video::Read::ended || read == Video::Read::failed) return false;
      if (read != Video::Read::frame || frame.seconds <= last) continue;
      if (!check_size({}, frame.image, calibrated_)) continue;
      last_ = frame.seconds;
      ahead_ = std::move(frame);
      return true;
    }
  }

  std::unique_ptr<Video> video_;
  Camera calibrated_;
  Camera ideal_;
  Undistorter undistort_;
  double first_;  // s
  std::optional<double> last_;
  std::optional<VideoFrame> ahead_;
  Time start_;
};

/// A stream, read in a thread of its own: reading waits for the network.
class VideoStreamSource : public FrameSource {
 public:
  VideoStreamSource(const VideoModule& library, std::string name, const Camera& camera)
      : library_(library),
        name_(std::move(name)),
        calibrated_(camera),
        ideal_(camera.undistorted()),
        undistort_(camera),
        thread_([this] { run(); }) {}
  ~VideoStreamSource() override {
    over_ = true;
    thread_.join();
  }

  Outcome next(LiveFrame& frame, int milliseconds) override {
    {
      std::unique_lock lock(mutex_);
      come_.wait_for(lock, std::chrono::milliseconds(milliseconds), [this] { return !waiting_.empty(); });
      if (waiting_.empty()) return Outcome::nothing;
      frame = std::move(waiting_.front());
      waiting_.pop_front();
    }
    frame.image = undistort_(frame.image);
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return ideal_; }
  [[nodiscard]] cv::Mat mask() const override { return undistort_.valid(); }
  [[nodiscard]] std::string remark() const override {
    const std::lock_guard lock(mutex_);
    return remark_;
  }

 private:
  static constexpr std::size_t kMostWaiting = 2;
  static constexpr auto kPause = std::chrono::milliseconds(500);

  void run() {
    while (!over_) {
      const auto tried = std::chrono::steady_clock::now();
      read_stream();
      while (!over_ && std::chrono::steady_clock::now() - tried < kPause)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  /// Until it fails.
  void read_stream() {
    std::string why;
    const VideoPlace place{
        name_, true, 1,
        [](const void* self) { return static_cast<const VideoStreamSource*>(self)->over_.load(); }, this};
    const auto video = library_.open(place, why);
    if (video == nullptr) return say(why);
    say("no frame has come yet");
    VideoClock clock;
    VideoFrame frame;
    while (!over_) {
      const Video::Read read = video->next(frame);
      if (read == Video::Read::ended || read == Video::Read::failed) return say(video->why());
      if (read != Video::Read::frame) {
        say("its frames are damaged or have no stamp");
        continue;
      }
      if (const Status size = check_size("it", frame.image, calibrated_); !size) {
        say(size.error().message);
        continue;
      }
      if (const auto time = clock.time_of(frame.seconds, frame.arrived))
        offer({std::move(frame.image), *time});
    }
  }

  void offer(LiveFrame frame) {
    {
      const std::lock_guard lock(mutex_);
      remark_.clear();
      if (frame.time <= last_) return;  // a restart of its clock: later frames follow
      last_ = frame.time;
      waiting_.push_back(std::move(frame));
      if (waiting_.size() > kMostWaiting) waiting_.pop_front();
    }
    come_.notify_one();
  }
  void say(const std::string& why) {
    const std::lock_guard lock(mutex_);
    remark_ = why;
  }

  const VideoModule& library_;
  std::string name_;
  Camera calibrated_;
  Camera ideal_;
  Undistorter undistort_;
  std::atomic<bool> over_{false};
  mutable std::mutex mutex_;  // of all below
  std::condition_variable come_;
  std::deque<LiveFrame> waiting_;
  Time last_;
  std::string remark_ = "it has not been opened yet";
  std::thread thread_;  // last: it uses all of the above
};

Result<std::unique_ptr<FrameSource>> open_video_file(const VideoModule& library, const std::string& name,
                                                     const Camera& camera) {
  std::string why;
  auto video = library.open({name, false, 0, nullptr, nullptr}, why);
  if (video == nullptr) return Error{fmt::format("{}: {}; expected a video that can be read", name, why)};
  VideoFrame first;
  Video::Read read = Video::Read::unusable;
  while (read == Video::Read::unusable) read = video->next(first);
  if (read == Video::Read::failed) return Error{fmt::format("{}: {}", name, video->why())};
  if (read != Video::Read::frame)
    return Error{
        fmt::format("{}: found no frame that can be decoded and has a stamp, expected a video", name)};
  if (const Status size = check_size(name, first.image, camera); !size) return size.error();
  return std::unique_ptr<FrameSource>(
      std::make_unique<VideoFileSource>(std::move(video), std::move(first), camera));
}

}  // namespace

const Result<const VideoModule*>& video_module() {
  static const Result<const VideoModule*> kLoaded = io::load_module<VideoModule>(
      {"libpade_video.so", video_module_symbol, "PADE's module for videos",
       "the package pade-video, or libavformat-dev, libavcodec-dev and libswscale-dev where PADE is built"});
  return kLoaded;
}

bool is_stream(const std::string& name) { return name.find("://") != std::string::npos; }

Result<std::unique_ptr<FrameSource>> open_video(const std::string& name, const Camera& camera) {
  if (camera.width <= 0 || camera.height <= 0)
    return Error{fmt::format("{}: the calibration states no image size, expected width and height", name)};
  const auto& library = video_module();
  if (!library) return Error{fmt::format("{}: {}", name, library.error().message)};
  if (!is_stream(name)) return open_video_file(**library, name, camera);
  return std::unique_ptr<FrameSource>(std::make_unique<VideoStreamSource>(**library, name, camera));
}

}  // namespace pade::live
