#include "pade/live/session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include <opencv2/core.hpp>

#include "pade/core/option_check.hpp"
#include "pade/live/camera/folder_source.hpp"

namespace pade::live {
namespace {

constexpr std::size_t kMostWaiting = 4;  // frames that wait for their poses

/// The newest frame of the camera, until somebody takes it.
class NewestFrame {
 public:
  void put(LiveFrame frame) {
    const std::lock_guard lock(mutex_);
    ++frames_;
    if (frame_) ++dropped_;
    frame_ = std::move(frame);
    come_.notify_one();
  }
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    come_.notify_one();
  }
  /// Waits at most so long.
  std::optional<LiveFrame> take(std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    come_.wait_for(lock, longest, [&] { return frame_.has_value() || ended_; });
    return std::exchange(frame_, std::nullopt);
  }
  [[nodiscard]] bool ended() const {
    const std::lock_guard lock(mutex_);
    return ended_ && !frame_;
  }
  [[nodiscard]] std::size_t frames() const { return frames_; }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }

 private:
  mutable std::mutex mutex_;
  std::condition_variable come_;
  std::optional<LiveFrame> frame_;
  std::size_t frames_ = 0;
  std::size_t dropped_ = 0;
  bool ended_ = false;
};

double share_with_depth(const DepthImage& image) {
  if (image.empty()) return 0;
  const double pixels = static_cast<double>(image.depth.total());
  return cv::countNonZero(image.depth == image.depth) / pixels;  // NaN is not equal to itself
}

}  // namespace

Status check(const SessionOptions& options) {
  const OptionRange ranges[] = {
      {"session.hold", options.hold, 0, 2},
      {"session.time_offset", options.time_offset, -1, 1},
      {"session.velocity_sigma", options.velocity_sigma, 0, 100},
      {"session.rotation_sigma", options.rotation_sigma, 0, 1},
      {"session.least_depth", options.least_depth, 0, 1},
  };
  return check_ranges(ranges);
}

void SectorSink::take(const LiveUpdate& update) {
  if (update.depth_share < least_depth_) return;
  const auto distances = obstacle_distances(*update.view, update.T_world_body, options_);
  link_.offer(obstacle_distance_message(distances, update.time, options_), update.time);
}

Result<Session> Session::create(const SessionParts& parts, const SessionOptions& options,
                                const ObstacleMapperOptions& mapper) {
  auto made = ObstacleMapper::create(parts.camera.camera(), mapper, parts.camera.mask());
  if (!made) return made.error();
  return Session(parts, options, mapper, std::move(*made));
}

void Session::run(const std::function<bool()>& stop) {
  NewestFrame newest;
  std::atomic<bool> over{false};
  std::thread camera([&] {
    constexpr int kPatience = 50;  // ms
    while (!over) {
      LiveFrame frame;
      const FrameSource::Outcome outcome = parts_.camera.next(frame, kPatience);
      if (outcome == FrameSource::Outcome::ended) break;
      if (outcome == FrameSource::Outcome::nothing) continue;
      parts_.progress.image = frame.time.nanoseconds;
      newest.put(std::move(frame));
    }
    newest.end();
  });
  std::vector<LiveFrame> waiting;
  while (!stop() && !(newest.ended() && waiting.empty())) {
    parts_.progress.mapper = now_of_ours().nanoseconds;
    if (auto frame = newest.take(std::chrono::milliseconds(waiting.empty() ? 20 : 2))) {
      if (waiting.size() == kMostWaiting) {
        waiting.erase(waiting.begin());
        skip("no pose in time");
      }
      waiting.push_back(std::move(*frame));
    }
    while (map_next(waiting, now_of_ours())) {
      parts_.progress.mapper = now_of_ours().nanoseconds;
    }
  }
  over = true;
  camera.join();
  for (std::size_t i = 0; i < waiting.size(); ++i) skip("the session ended");
  counts_.frames = newest.frames();
  counts_.dropped = newest.dropped();
  counts_.dropped += newest.take(std::chrono::milliseconds(0)) ? 1U : 0U;
}

void Session::skip(const std::string& reason) {
  ++counts_.skipped;
  ++counts_.reasons[reason];
}

/// Maps or skips the oldest of the frames that wait; false if it has to wait on, or if there is none.
bool Session::map_next(std::vector<LiveFrame>& waiting, Time now) {
  if (waiting.empty()) return false;
  const LiveFrame& frame = waiting.front();
  const std::size_t jumps = parts_.poses.jumps();
  const Time asked{frame.time.nanoseconds + static_cast<std::int64_t>(options_.time_offset * 1e9)};
  const PoseAnswer answer = parts_.poses.pose_at(asked);
  if (answer.kind == PoseAnswer::Kind::not_yet && seconds_between(frame.time, now) < options_.hold) {
    return false;
  }
  if (jumps != jumps_) begin_anew();
  jumps_ = jumps;
  if (answer.kind == PoseAnswer::Kind::valid) {
    map_frame(frame, answer.T_world_body);
  } else {
    skip(answer.kind == PoseAnswer::Kind::never ? std::string(answer.why) : "no pose in time");
  }
  waiting.erase(waiting.begin());
  return true;
}

/// Poses before and after do not belong together.
void Session::begin_anew() {
  auto made = ObstacleMapper::create(parts_.camera.camera(), mapper_options_, parts_.camera.mask());
  if (!made) return;  // as at the start, where it was possible
  mapper_ = std::move(*made);
  view_.reset();
  ++counts_.restarts;
}

void Session::map_frame(const LiveFrame& frame, const Pose& T_world_body) {
  Matrix6d covariance = Matrix6d::Zero();
  const double way = options_.velocity_sigma * std::clamp(seconds_between(last_, frame.time), 0.0, 1.0);
  covariance.diagonal().head<3>().setConstant(way * way);
  covariance.diagonal().tail<3>().setConstant(options_.rotation_sigma * options_.rotation_sigma);
  const MapperUpdate& update =
      mapper_.add(frame.image, frame.time, camera_pose(T_world_body, parts_.T_body_camera), covariance);
  if (update.outcome == MapperUpdate::Outcome::skipped) {
    skip(update.reason);
    return;
  }
  last_ = frame.time;
  ++counts_.mapped;
  if (update.outcome != MapperUpdate::Outcome::mapped) return;
  view_ = view_ ? view_->after(mapper_.map(), update.change) : mapping::MapView::of(mapper_.map());
  const double share = share_with_depth(update.depth);
  if (share >= options_.least_depth) parts_.progress.depth = frame.time.nanoseconds;
  const LiveUpdate result{frame.time, camera_pose(mapper_.T_world_camera(), parts_.T_body_camera.inverse()),
                          view_, share};
  for (Sink* const sink : parts_.sinks) sink->take(result);
}

}  // namespace pade::live
