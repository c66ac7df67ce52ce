#include "bridge.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>
#include <pade/io/formats/map_files.hpp>

#include "diagnoses.hpp"
#include "map_content.hpp"
#include "running.hpp"

namespace pade_ros {
namespace {

using pade::seconds_between;
using pade::Time;

constexpr std::size_t kMostOfBags = 256;  // frames that wait where every one is to be mapped

}  // namespace

void Running::add(const Image& message) {
  const double now = steady_seconds();
  bool back = false;
  {
    const std::lock_guard lock(mutex_);
    counts_.images.tick(now);
    constexpr Stamp kNone = std::numeric_limits<Stamp>::min();
    const double by = newest_ == kNone ? 0 : seconds_between({message.stamp}, {newest_});
    back = by > kClockWentBack;
    if (back) {
      anew_ = fmt::format("the time went back by {:.1f} s", by);
      counts_.dropped += waiting_.size();
      waiting_.clear();
      newest_ = message.stamp;
    }
    newest_ = std::max(newest_, message.stamp);
  }
  if (back) {
    poses_->clear_after({message.stamp});
    transforms_.clear();
  }
  {
    const std::lock_guard lock(mutex_);
    const bool all = options_.max_latency == 0;
    const std::size_t most = all ? kMostOfBags : static_cast<std::size_t>(options_.most_waiting);
    if (waiting_.size() >= most) {
      // The oldest stays, whose pose comes next.
      waiting_.erase(waiting_.begin() + (waiting_.size() > 1 ? 1 : 0));
      ++counts_.dropped;
    }
    waiting_.push_back({message, now});
  }
  come_.notify_all();
}

void Running::add(const CameraInfo& message) {
  const std::lock_guard lock(mutex_);
  counts_.infos.tick(steady_seconds());
  if (info_ && is_same_lens(*info_, message)) return;
  info_ = message;
  auto eye = eye_of(message, options_.rectified);
  eye_problem_ = eye ? std::string() : eye.error().message;
  eye_ = eye ? *eye : nullptr;
  come_.notify_all();
}

/// Says each kind of thing once in ten seconds.
void Running::say(Diagnosis::Level level, const std::string& text) {
  constexpr double kAgain = 10;  // s
  {
    const std::lock_guard lock(mutex_);
    const double now = steady_seconds();
    const std::string kind = kind_of(text);
    const auto found = said_.find(kind);
    if (found != said_.end() && now - found->second < kAgain) return;
    said_[kind] = now;
  }
  sink_.log(level, text);
}

void Running::skip(const std::string& reason) {
  {
    const std::lock_guard lock(mutex_);
    constexpr std::size_t kMostReasons = 30;  // in full; of further ones their kinds
    ++counts_.skipped;
    const bool full = counts_.reasons.size() < kMostReasons || counts_.reasons.count(reason) > 0;
    ++counts_.reasons[full ? reason : kind_of(reason)];
  }
  say(Diagnosis::warning, fmt::format("frames are skipped: {}", reason));
}

/// Frames that have their poses are mapped in their order as long as the newest of them will still be worth
/// it; of those before it that take too long the oldest go. The mutex is held.
void Running::pass_over_old(double now) {
  if (options_.max_latency == 0) return;
  std::size_t known = 0;
  while (known < waiting_.size()) {
    const Time time = pose_time({waiting_[known].message.stamp});
    if (poses_->at(time, camera_frame(waiting_[known].message)).kind != PoseReply::Kind::valid) break;
    ++known;
  }
  while (known > 1 &&
         now - waiting_[known - 1].arrival + static_cast<double>(known) * busy_ > options_.max_latency) {
    waiting_.pop_front();
    ++counts_.dropped;
    --known;
  }
}

/// The oldest frame, if its pose is there, or will not come any more.
std::optional<WaitingFrame> Running::next_frame(PoseReply& reply) {
  const std::lock_guard lock(mutex_);
  const double now = steady_seconds();
  if (!eye_) {
    if (waiting_.empty() || now - waiting_.front().arrival < options_.max_wait_for_pose) return std::nullopt;
    reply.kind = PoseReply::Kind::never;
    reply.why = eye_problem_.empty() ? fmt::format("no camera_info has come on {}", topics_.camera_info)
                                     : fmt::format("camera_info is unusable: {}", eye_problem_);
  } else {
    pass_over_old(now);
    if (waiting_.empty()) return std::nullopt;
    const WaitingFrame& frame = waiting_.front();
    reply = poses_->at(pose_time({frame.message.stamp}), camera_frame(frame.message));
    if (reply.kind == PoseReply::Kind::not_yet && now - frame.arrival < options_.max_wait_for_pose)
      return std::nullopt;
  }
  WaitingFrame frame = std::move(waiting_.front());
  waiting_.pop_front();
  return frame;
}

void Running::run_mapper() {
  using namespace std::chrono_literals;
  while (true) {
    std::string anew;
    std::vector<std::function<void()>> errands;
    bool over = false;
    {
      std::unique_lock lock(mutex_);
      if (!over_ && anew_.empty() && errands_.empty()) {
        if (waiting_.empty())
          come_.wait_for(lock, 100ms);
        else
          come_.wait_for(lock, 2ms);  // a pose may come by a transform, of which nobody tells
      }
      anew = std::exchange(anew_, {});
      errands = std::exchange(errands_, {});
      over = over_;
    }
    if (!anew.empty()) begin_anew(anew);
    for (const auto& errand : errands) errand();
    if (over) return;
    PoseReply reply;
    while (auto frame = next_frame(reply)) {
      if (reply.jumps != jumps_) {
        jumps_ = reply.jumps;
        begin_anew(reply.last_jump);
      }
      if (reply.kind == PoseReply::Kind::valid) {
        map_frame(*frame, reply);
      } else {
        skip(reply.why.empty() ? "no pose in time" : reply.why);
        forget(Time{frame->message.stamp});
      }
      const std::lock_guard lock(mutex_);
      if (over_ || !anew_.empty() || !errands_.empty()) break;
    }
  }
}

/// Maps are made and sent beside the mapper, from views that do not change.
void Running::run_maps() {
  const double period = 1 / options_.map_rate;
  double last = -std::numeric_limits<double>::infinity();
  Wanted before;
  while (true) {
    std::shared_ptr<const pade::mapping::MapView> view;
    MapResult head;
    bool is_new = false;
    {
      std::unique_lock lock(mutex_);
      const double wait = std::clamp(last + period - steady_seconds(), 0.01, 0.25);
      come_.wait_for(lock, std::chrono::duration<double>(wait), [&] { return over_; });
      if (over_) return;
      if (!ever_mapped_ || steady_seconds() < last + period) continue;
      view = view_;
      is_new = view_new_;
      head.stamp = view_stamp_;
      head.world_frame = view_world_;
    }
    const Wanted wanted = sink_.wanted();
    const bool more = (wanted.binary && !before.binary) || (wanted.full && !before.full) ||
                      (wanted.voxels && !before.voxels) || (wanted.projected && !before.projected);
    if (!is_new && !more) continue;
    before = wanted;
    last = steady_seconds();
    if (is_new) {
      const std::lock_guard lock(mutex_);
      view_new_ = view_ != view;
    }
    MapResult result;
    if (view) result = map_content(*view, wanted, options_.occupancy_min_z, options_.occupancy_max_z);
    result.voxel = options_.mapper.map.voxel;
    result.stamp = head.stamp;
    result.world_frame = head.world_frame;
    sink_.map(result);
  }
}

/// Has the mapper's thread do something between two frames, and waits until it is done.
void Running::do_between_frames(const std::function<void()>& errand) {
  std::mutex done_mutex;
  std::condition_variable done_come;
  bool done = false;
  {
    const std::lock_guard lock(mutex_);
    errands_.emplace_back([&] {
      errand();
      const std::lock_guard done_lock(done_mutex);
      done = true;
      done_come.notify_all();
    });
  }
  come_.notify_all();
  std::unique_lock lock(done_mutex);
  done_come.wait(lock, [&] { return done; });
}

void Running::reset() {
  do_between_frames([&] { begin_anew("asked for by reset"); });
}

bool Running::save_map(const std::string& file, std::string& message) {
  namespace fs = std::filesystem;
  const fs::path wanted = file.empty() ? fs::path(options_.map_file) : fs::path(file);
  const std::string extension = wanted.extension().string();
  if (extension != ".bt" && extension != ".ot") {
    message = fmt::format("{}: the name of a map file must end in .bt or .ot", wanted.string());
    return false;
  }
  std::string content, side_car;
  do_between_frames([&] {
    if (!mapper_ || mapped_anew_ == 0) return;
    const auto format = extension == ".bt" ? pade::io::MapFormat::bt : pade::io::MapFormat::ot;
    content = pade::io::bytes_of(pade::io::encode_map(mapper_->map(), format));
    side_car = pade::io::encode_side_car(options_.mapper.map, std::nullopt, origin_);
  });
  if (content.empty()) {
    message = "nothing is mapped yet: no file was written";
    return false;
  }
  fs::path path = wanted;
  std::error_code error;
  for (int number = 1; fs::exists(path, error); ++number)
    path = wanted.parent_path() / fmt::format("{}-{}{}", wanted.stem().string(), number, extension);
  const auto write = [&](const fs::path& to, const std::string& bytes) {
    return pade::io::write_file(
        to, [&](const pade::io::ByteSink& sink) { sink(bytes); }, pade::io::Overwrite::refuse);
  };
  pade::Status status = write(path, content);
  if (status && !fs::exists(pade::io::side_car_of(path), error))
    status = write(pade::io::side_car_of(path), side_car);
  message = status ? fs::absolute(path, error).string() : status.error().message;
  return status.ok();
}

bool Running::map_now(const Wanted& wanted, MapResult& result) {
  std::shared_ptr<const pade::mapping::MapView> view;
  Stamp stamp = 0;
  std::string world;
  {
    const std::lock_guard lock(mutex_);
    view = view_;
    stamp = view_stamp_;
    world = view_world_;
  }
  if (!view) return false;
  result = map_content(*view, wanted, options_.occupancy_min_z, options_.occupancy_max_z);
  result.stamp = stamp;
  result.world_frame = world;
  return true;
}

std::vector<Diagnosis> Running::diagnose() {
  const double now = steady_seconds();
  std::vector<Diagnosis> out;
  Diagnosis poses = poses_->diagnose(now);
  {
    const std::lock_guard lock(mutex_);
    out.push_back(diagnose_camera(counts_, topics_, waiting_.size(), now));
    out.push_back(diagnose_calibration(counts_, topics_, info_ ? &*info_ : nullptr, eye_problem_,
                                       waiting_.empty() ? nullptr : &waiting_.back().message, now));
    out.push_back(std::move(poses));
    out.push_back(diagnose_mapper(counts_, now));
  }
  for (const Diagnosis& one : out) {
    if (one.level != Diagnosis::ok && one.name != "mapper")
      say(one.level, fmt::format("{}: {}", one.name, one.message));
  }
  return out;
}

std::string text_of(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  return fmt::format("{}", value);
}

std::unique_ptr<Bridge> Bridge::create(const Parameters& parameters, const Topics& topics, Sink& sink,
                                       Transforms& transforms, std::string& error) {
  const auto options = read_parameters(parameters);
  if (!options) {
    error = options.error().message;
    return nullptr;
  }
  if (pade::Status status = check(*options); !status) {
    error = status.error().message;
    return nullptr;
  }
  return std::make_unique<Running>(*options, topics, sink, transforms);
}

}  // namespace pade_ros
