#include "pade/live/session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/core/option_check.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/link/obstacle_points.hpp"
#include "pade/mapping/query/map_border.hpp"

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
  [[nodiscard]] std::size_t frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  [[nodiscard]] std::size_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable come_;
  std::optional<LiveFrame> frame_;
  std::size_t frames_ = 0;
  std::size_t dropped_ = 0;
  bool ended_ = false;
};

/// Lets somebody run until the end of the scope, whatever ends it.
class CameraThread {
 public:
  template <class Work>
  explicit CameraThread(const Work& work) : thread_([this, work] { work(over_); }) {}
  CameraThread(const CameraThread&) = delete;
  CameraThread& operator=(const CameraThread&) = delete;
  ~CameraThread() { end(); }
  void end() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> over_{false};
  std::thread thread_;
};

/// Makes room without taking away the frame whose pose will come next: of the others that wait goes the one
/// whose neighbours are closest to each other.
void thin_out(std::vector<LiveFrame>& waiting, Time newest) {
  std::size_t go = 1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < waiting.size(); ++i) {
    const double gap =
        seconds_between(waiting[i - 1].time, i + 1 < waiting.size() ? waiting[i + 1].time : newest);
    if (gap < least) {
      least = gap;
      go = i;
    }
  }
  waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(go));
}

double share_with_depth(const DepthImage& image) {
  if (image.empty()) return 0;
  std::size_t known = 0;
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* row = image.depth.ptr<float>(v);
    known += static_cast<std::size_t>(
        std::count_if(row, row + image.depth.cols, [](float depth) { return !std::isnan(depth); }));
  }
  return static_cast<double>(known) / static_cast<double>(image.depth.total());
}

/// A time that a recording tells, in our time of when it is told.
Time in_ours(Time time, double behind) {
  return {time.nanoseconds + static_cast<std::int64_t>(behind * 1e9)};
}

}  // namespace

Status check(const SessionOptions& options) {
  const OptionRange ranges[] = {
      {"session.hold", options.hold, 0.02, 2},
      {"session.time_offset", options.time_offset, -1, 1},
      {"session.velocity_sigma", options.velocity_sigma, 0, 100},
      {"session.rotation_sigma", options.rotation_sigma, 0, 1},
      {"session.least_depth", options.least_depth, 0.001, 1},
  };
  return check_ranges(ranges);
}

void SectorSink::take(const LiveUpdate& update) {
  if (update.depth_share < least_depth_) return;
  const auto distances = obstacle_distances(*update.view, update.T_world_body, options_, view_);
  const bool says_anything =
      std::any_of(distances.begin(), distances.end(), [](std::uint16_t d) { return d != kUnknownDistance; });
  FrameObstacles obstacles{{}, {}, options_, time_offset};
  if (says_anything) obstacles.level = obstacle_distance_message(distances, update.time, options_);
  if (eye_)
    obstacles.points =
        obstacle_points(*update.view, update.T_world_body, options_, eye_->camera, eye_->T_body_camera);
  link_.offer(obstacles, update.time);
  if (listener) listener(distances, update.time);
}

std::string stamp_text(const std::optional<StampOffset>& offset) {
  if (!offset || !offset->is_certain()) return {};
  return fmt::format(
      "the images' stamps are {:.1f} ms {} (1 sigma {:.1f} ms): add {:.4f} to session.time_offset",
      1e3 * std::abs(offset->seconds), offset->seconds < 0 ? "late" : "early", 1e3 * offset->sigma,
      offset->seconds);
}

Result<Session> Session::create(const SessionParts& parts, const SessionOptions& options,
                                const ObstacleMapperOptions& mapper) {
  auto made = ObstacleMapper::create(parts.camera.camera(), mapper, parts.camera.mask());
  if (!made) return made.error();
  return Session(parts, options, mapper, std::move(*made));
}

void Session::run(const std::function<bool()>& stop) {
  NewestFrame newest;
  CameraThread camera([&](const std::atomic<bool>& over) {
    constexpr int kPatience = 50;  // ms
    Time heard = now_of_ours();    // a frame, or why none comes
    while (!over) {
      LiveFrame frame;
      const FrameSource::Outcome outcome = parts_.camera.next(frame, kPatience);
      if (outcome == FrameSource::Outcome::ended) break;
      const Time now = now_of_ours();
      if (outcome == FrameSource::Outcome::nothing) {
        if (seconds_between(heard, now) < kStale) continue;
        parts_.progress.no_image.set(parts_.camera.remark());
        heard = now;
        continue;
      }
      heard = now;
      parts_.progress.no_image.set({});
      parts_.progress.image = in_ours(frame.time, parts_.camera.behind()).nanoseconds;
      newest.put(std::move(frame));
    }
    newest.end();
  });
  std::vector<LiveFrame> waiting;
  std::size_t dropped_before = 0;
  const auto count = [&] {
    counts_.frames = newest.frames();
    const std::size_t dropped = newest.dropped();
    counts_.dropped += dropped - dropped_before;
    dropped_before = dropped;
  };
  Time last_frame;  // that came
  while (!stop() && !(newest.ended() && waiting.empty())) {
    constexpr double kNothingComes = 0.25;  // s
    parts_.progress.mapper = now_of_ours().nanoseconds;
    if (auto frame = newest.take(std::chrono::milliseconds(waiting.empty() ? 20 : 2))) {
      last_frame = frame->time;
      if (waiting.size() == kMostWaiting) {
        thin_out(waiting, frame->time);
        ++counts_.dropped;
      }
      waiting.push_back(std::move(*frame));
    }
    const Time now = in_ours(now_of_ours(), -parts_.camera.behind());
    map_next(waiting, now);
    if (waiting.empty() && seconds_between(last_frame, now) > kNothingComes) forget(now);
    count();
  }
  camera.end();
  for (std::size_t i = 0; i < waiting.size(); ++i) skip("the session ended");
  count();
  counts_.dropped += newest.take(std::chrono::milliseconds(0)) ? 1U : 0U;
}

void Session::skip(const std::string& reason) {
  ++counts_.skipped;
  ++counts_.reasons[reason];
}

Time Session::time_of_pose(Time frame) const {
  return {frame.nanoseconds + static_cast<std::int64_t>(options_.time_offset * 1e9)};
}

PoseAnswer Session::pose_of(const LiveFrame& frame) const {
  return parts_.poses.pose_at(time_of_pose(frame.time));
}

/// Of the motion since the last frame that was mapped: what the source of poses knows, else what the options
/// say.
Matrix6d Session::covariance_of(const LiveFrame& frame) const {
  const auto known =
      parts_.poses.motion_covariance(time_of_pose(last_), time_of_pose(frame.time), parts_.T_body_camera);
  if (known) return *known;
  Matrix6d covariance = Matrix6d::Zero();
  const double way = options_.velocity_sigma * std::clamp(seconds_between(last_, frame.time), 0.0, 1.0);
  covariance.diagonal().head<3>().setConstant(way * way);
  covariance.diagonal().tail<3>().setConstant(options_.rotation_sigma * options_.rotation_sigma);
  return covariance;
}

/// Frames that have their poses are mapped in their order as long as the newest of them will still be worth
/// sending; of those before it that take too long the oldest go.
void Session::pass_over_old(std::vector<LiveFrame>& waiting, Time now) {
  constexpr double kInTime = 0.25;  // s
  std::size_t known = 0;
  while (known < waiting.size() && pose_of(waiting[known]).kind == PoseAnswer::Kind::valid) ++known;
  while (known > 1 &&
         seconds_between(waiting[known - 1].time, now) + static_cast<double>(known) * busy_ > kInTime) {
    waiting.erase(waiting.begin());
    ++counts_.dropped;
    --known;
  }
}

/// Maps or skips the oldest of the frames that wait; false if it has to wait on, or if there is none.
bool Session::map_next(std::vector<LiveFrame>& waiting, Time now) {
  pass_over_old(waiting, now);
  if (waiting.empty()) return false;
  const LiveFrame& frame = waiting.front();
  const PoseAnswer answer = pose_of(frame);
  if (answer.kind == PoseAnswer::Kind::not_yet && seconds_between(frame.time, now) < options_.hold) {
    return false;
  }
  if (answer.kind == PoseAnswer::Kind::valid) {
    if (answer.jumps != jumps_ && begin_anew()) origin_.setZero();
    jumps_ = answer.jumps;
    const bool far =
        mapping::is_near_the_border(answer.T_world_body.translation - origin_, mapper_options_.map.voxel);
    if (far && any_frame_) counts_.borders += begin_anew() ? 1 : 0;
    if (far && !any_frame_) origin_ = answer.T_world_body.translation;
    const Time begun = now_of_ours();
    map_frame(frame, {answer.T_world_body.rotation, answer.T_world_body.translation - origin_});
    const double took = seconds_between(begun, now_of_ours());
    busy_ = busy_ > 0 ? 0.7 * busy_ + 0.3 * took : took;
  } else {
    skip(answer.kind == PoseAnswer::Kind::never ? std::string(answer.why) : "no pose in time");
    forget(frame.time);
    pass(frame);
  }
  waiting.erase(waiting.begin());
  return true;
}

void Session::pass(const LiveFrame& frame) {
  for (Sink* const sink : parts_.sinks) sink->pass(frame);
}

/// What nobody has seen again for so long as MapOptions::forget_after says, where no frame is mapped.
void Session::forget(Time now) {
  if (!view_) return;
  tell_forgotten(mapper_.forget(now));
}

void Session::tell_forgotten(const mapping::MapChange& change) {
  if (!view_ || change.touched.empty()) return;
  view_ = view_->after(mapper_.map(), change);
  for (Sink* const sink : parts_.sinks) sink->forget(view_, change);
}

/// What comes does not belong to what was there. False if that cannot be.
bool Session::begin_anew() {
  auto made = ObstacleMapper::create(parts_.camera.camera(), mapper_options_, parts_.camera.mask());
  if (!made) return false;  // as at the start, where it was possible
  mapper_ = std::move(*made);
  view_.reset();
  any_frame_ = false;
  if (parts_.recorder != nullptr) parts_.recorder->begin_anew();
  counts_.mapped_anew = 0;
  ++counts_.restarts;
  for (Sink* const sink : parts_.sinks) sink->begin_anew();
  return true;
}

void Session::map_frame(const LiveFrame& frame, const Pose& T_world_body) {
  any_frame_ = true;
  const Matrix6d covariance = covariance_of(frame);
  const Pose T_world_camera = camera_pose(T_world_body, parts_.T_body_camera);
  if (parts_.recorder != nullptr)
    parts_.recorder->take({frame.image, frame.time, T_world_camera, covariance});
  const MapperUpdate& update = mapper_.add(frame.image, frame.time, T_world_camera, covariance);
  if (update.outcome == MapperUpdate::Outcome::skipped) {
    tell_forgotten(update.change);
    forget(frame.time);
    skip(update.reason.substr(0, update.reason.find_first_of("0123456789")));  // one count for each kind
    pass(frame);
    return;
  }
  last_ = frame.time;
  ++counts_.mapped;
  ++counts_.mapped_anew;
  if (update.outcome != MapperUpdate::Outcome::mapped) {
    pass(frame);
    return;
  }
  counts_.outside += update.change.outside;
  view_ = view_ ? view_->after(mapper_.map(), update.change) : mapping::MapView::of(mapper_.map());
  const double share = share_with_depth(update.depth);
  const double behind = parts_.camera.behind();
  if (share >= options_.least_depth) parts_.progress.depth = in_ours(frame.time, behind).nanoseconds;
  const LiveUpdate result{frame.time,  camera_pose(mapper_.T_world_camera(), parts_.T_body_camera.inverse()),
                          view_,       share,
                          frame.image, &update,
                          origin_,     behind};
  for (Sink* const sink : parts_.sinks) sink->take(result);
}

}  // namespace pade::live
