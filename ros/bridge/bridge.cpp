#include "bridge.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <pade/io/formats/map_files.hpp>
#include <pade/io/recording/messages/image_messages.hpp>
#include <pade/pade.hpp>

#include "counts.hpp"
#include "map_content.hpp"
#include "node_options.hpp"
#include "pose_inputs.hpp"

namespace pade_ros {
namespace {

using pade::MapperUpdate;
using pade::ObstacleMapper;
using pade::Pose;
using pade::seconds_between;
using pade::Time;

constexpr std::size_t kMostOfBags = 256;  // frames that wait where every one is to be mapped

/// An image, and when it came.
struct WaitingFrame {
  Image message;
  double arrival = 0;  // steady seconds
};

/// The calibration, and what was made of it.
struct Eye {
  pade::Camera lens;
  pade::Undistorter undistort;
};

double share_with_depth(const pade::DepthImage& image) {
  if (image.empty()) return 0;
  const cv::Mat known = image.depth == image.depth;  // NaN is not equal to itself
  return static_cast<double>(cv::countNonZero(known)) / static_cast<double>(image.depth.total());
}

/// One count for each kind of reason: up to the first number in it.
std::string kind_of(const std::string& reason) {
  std::string kind = reason.substr(0, reason.find_first_of("0123456789"));
  while (!kind.empty() && (kind.back() == ' ' || kind.back() == '-')) kind.pop_back();
  return kind.empty() ? reason : kind;
}

class Running : public Bridge {
 public:
  Running(const NodeOptions& options, Topics topics, Sink& sink, Transforms& transforms)
      : options_(options),
        topics_(std::move(topics)),
        sink_(sink),
        transforms_(transforms),
        poses_(make_pose_input(options, topics_, transforms)),
        mapper_thread_([this] { run_mapper(); }),
        map_thread_([this] { run_maps(); }) {}
  ~Running() override {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    come_.notify_all();
    mapper_thread_.join();
    map_thread_.join();
  }

  void add(const Image& message) override;
  void add(const CameraInfo& message) override;
  void add(const PoseMessage& message) override { pass_on(message); }
  void add(const ImuMessage& message) override { pass_on(message); }
  void add(const FixMessage& message) override { pass_on(message); }
  void add(const VelocityMessage& message) override { pass_on(message); }
  void add(const FieldMessage& message) override { pass_on(message); }
  void add(const PressureMessage& message) override { pass_on(message); }
  void reset() override;
  bool save_map(const std::string& file, std::string& message) override;
  bool map_now(const Wanted& wanted, MapResult& result) override;
  std::vector<Diagnosis> diagnose() override;

 private:
  void do_between_frames(const std::function<void()>& errand);
  template <class Message>
  void pass_on(const Message& message) {
    poses_->add(message);
    come_.notify_all();
  }
  void run_mapper();
  void run_maps();
  std::optional<WaitingFrame> next_frame(PoseReply& reply);
  void pass_over_old(double now);
  void map_frame(const WaitingFrame& frame, const PoseReply& reply);
  void begin_anew(const std::string& why);
  void skip(const std::string& reason);
  void say(Diagnosis::Level level, const std::string& text);
  std::optional<cv::Mat> image_of(const Image& message);
  void tell(const WaitingFrame& frame, const PoseReply& reply, const MapperUpdate& update,
            const cv::Mat& image);
  std::string camera_frame(const Image& message) const {
    return frame_name(options_.camera_frame.empty() ? message.frame : options_.camera_frame);
  }
  Diagnosis diagnose_camera(double now);
  Diagnosis diagnose_calibration(double now);
  Diagnosis diagnose_mapper(double now);

  const NodeOptions options_;
  const Topics topics_;
  Sink& sink_;
  Transforms& transforms_;
  const std::unique_ptr<PoseInput> poses_;

  std::mutex mutex_;  // of all below up to the next remark
  std::condition_variable come_;
  bool over_ = false;
  std::deque<WaitingFrame> waiting_;
  Stamp newest_ = std::numeric_limits<Stamp>::min();
  std::string anew_;                            // why the map is to be begun anew; empty: it is not
  std::vector<std::function<void()>> errands_;  // for the mapper's thread
  std::optional<CameraInfo> info_;              // as it came last
  std::shared_ptr<const Eye> eye_;              // of it
  std::string eye_problem_;                     // why there is none
  Counts counts_;
  std::map<std::string, double> said_;                  // and when
  double busy_ = 0;                                     // that a frame took lately, s
  std::shared_ptr<const pade::mapping::MapView> view_;  // null: nothing was mapped
  Stamp view_stamp_ = 0;
  std::string view_world_;
  bool view_new_ = false;
  std::string stamp_text_;  // what the images say of their stamps

  // Of the mapper's thread.
  std::shared_ptr<const Eye> mapped_eye_;
  std::optional<ObstacleMapper> mapper_;
  std::size_t jumps_ = 0;
  Time last_;
  std::size_t mapped_anew_ = 0;
  std::vector<PathPose> path_;
  std::size_t path_step_ = 1, path_left_out_ = 0;

  std::thread mapper_thread_, map_thread_;
};

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
  const auto same = [](const CameraInfo& a, const CameraInfo& b) {
    return a.width == b.width && a.height == b.height && a.model == b.model && a.d == b.d && a.k == b.k &&
           a.r == b.r && a.p == b.p && a.binning_x == b.binning_x && a.binning_y == b.binning_y &&
           a.x_offset == b.x_offset && a.y_offset == b.y_offset;
  };
  const std::lock_guard lock(mutex_);
  counts_.infos.tick(steady_seconds());
  if (info_ && same(*info_, message)) return;
  info_ = message;
  pade::io::CameraInfoMessage info;
  info.width = message.width;
  info.height = message.height;
  info.model = message.model;
  info.d = message.d;
  info.k = message.k;
  info.r = message.r;
  info.p = message.p;
  info.binning_x = message.binning_x;
  info.binning_y = message.binning_y;
  info.x_offset = message.x_offset;
  info.y_offset = message.y_offset;
  const auto camera = pade::io::camera_of(info, options_.rectified);
  eye_.reset();
  eye_problem_.clear();
  if (!camera) {
    eye_problem_ = camera.error().message;
  } else if (camera->width <= 0 || camera->height <= 0) {
    eye_problem_ = fmt::format("it is for {} x {} pixels", message.width, message.height);
  } else {
    eye_ = std::make_shared<const Eye>(Eye{*camera, pade::Undistorter(*camera)});
  }
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
    const Time time{waiting_[known].message.stamp + static_cast<Stamp>(options_.time_offset * 1e9)};
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
    const Time time{frame.message.stamp + static_cast<Stamp>(options_.time_offset * 1e9)};
    reply = poses_->at(time, camera_frame(frame.message));
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
      if (reply.kind == PoseReply::Kind::valid)
        map_frame(*frame, reply);
      else
        skip(reply.why.empty() ? "no pose in time" : reply.why);
      const std::lock_guard lock(mutex_);
      if (over_ || !anew_.empty() || !errands_.empty()) break;
    }
  }
}

/// Empty, and counted, where it cannot be used.
std::optional<cv::Mat> Running::image_of(const Image& message) {
  const std::string_view bytes(reinterpret_cast<const char*>(message.data), message.size);
  pade::Result<cv::Mat> pixels = pade::Error{};
  if (message.compressed) {
    pade::io::CompressedImageMessage image;
    image.format = message.encoding;
    image.data = bytes;
    pixels = pade::io::pixels_of(image);
  } else {
    pade::io::ImageMessage image;
    image.height = message.height;
    image.width = message.width;
    image.encoding = message.encoding;
    image.big_endian = message.big_endian;
    image.step = message.step;
    image.data = bytes;
    pixels = pade::io::pixels_of(image);
  }
  if (!pixels) {
    skip(fmt::format("the image is unusable: {}", pixels.error().message));
    return std::nullopt;
  }
  if (pixels->depth() != CV_8U) {
    skip(fmt::format("the image is unusable: found {} bits, expected 8", 8 * pixels->elemSize1()));
    return std::nullopt;
  }
  const pade::Camera& lens = mapped_eye_->lens;
  if (pixels->size() != lens.size()) {
    skip(fmt::format("the images have {} x {} pixels, and camera_info is for {} x {}", pixels->cols,
                     pixels->rows, lens.width, lens.height));
    return std::nullopt;
  }
  return mapped_eye_->undistort(*pixels);
}

void Running::begin_anew(const std::string& why) {
  mapper_.reset();
  path_.clear();
  path_step_ = 1;
  path_left_out_ = 0;
  last_ = {};
  const bool lost_something = mapped_anew_ > 0;
  mapped_anew_ = 0;
  {
    const std::lock_guard lock(mutex_);
    if (view_) {
      view_.reset();
      view_new_ = true;
    }
    if (!lost_something) return;
    ++counts_.restarts;
    counts_.last_restart = why;
  }
  come_.notify_all();
  sink_.log(Diagnosis::warning, fmt::format("the map is begun anew: {}", why));
}

void Running::map_frame(const WaitingFrame& frame, const PoseReply& reply) {
  const double begin = steady_seconds();
  std::shared_ptr<const Eye> eye;
  {
    const std::lock_guard lock(mutex_);
    eye = eye_;
  }
  if (!eye) return skip("camera_info is unusable");
  if (mapped_eye_ && eye != mapped_eye_) begin_anew("camera_info has changed");
  mapped_eye_ = eye;
  const auto image = image_of(frame.message);
  if (!image) return;
  if (!mapper_) {
    auto made = ObstacleMapper::create(eye->lens.undistorted(), options_.mapper, eye->undistort.valid());
    if (!made) return skip(made.error().message);
    mapper_.emplace(std::move(*made));
  }
  const Time time{frame.message.stamp};
  const auto shifted = [&](Time t) {
    return Time{t.nanoseconds + static_cast<Stamp>(options_.time_offset * 1e9)};
  };
  pade::Matrix6d covariance = pade::Matrix6d::Zero();
  const auto known =
      last_.nanoseconds != 0 ? poses_->covariance(shifted(last_), shifted(time)) : std::nullopt;
  if (known) {
    covariance = *known;
  } else {
    const double way = options_.velocity_sigma *
                       (last_.nanoseconds != 0 ? std::clamp(seconds_between(last_, time), 0.0, 1.0) : 0.0);
    covariance.diagonal().head<3>().setConstant(way * way);
    covariance.diagonal().tail<3>().setConstant(options_.rotation_sigma * options_.rotation_sigma);
  }
  const MapperUpdate& update = mapper_->add(*image, time, reply.T_world_camera, covariance);
  if (update.outcome == MapperUpdate::Outcome::skipped) return skip(kind_of(update.reason));
  last_ = time;
  ++mapped_anew_;
  const bool mapped = update.outcome == MapperUpdate::Outcome::mapped;
  const double share = mapped ? share_with_depth(update.depth) : 0;
  std::shared_ptr<const pade::mapping::MapView> view;
  if (mapped) {
    const std::lock_guard lock(mutex_);
    view = view_;
  }
  if (mapped) {
    view = view ? view->after(mapper_->map(), update.change) : pade::mapping::MapView::of(mapper_->map());
    tell(frame, reply, update, *image);
  }
  const std::string world = poses_->world();
  const double end = steady_seconds();
  const std::lock_guard lock(mutex_);
  counts_.mapped.tick(end);
  if (!mapped) return;
  view_ = std::move(view);
  view_stamp_ = time.nanoseconds;
  view_world_ = world;
  view_new_ = true;
  counts_.depth_share = share;
  if (share >= options_.least_depth) counts_.last_depth = end;
  counts_.latency.add(end - frame.arrival);
  counts_.work.add(end - begin);
  busy_ = busy_ > 0 ? 0.7 * busy_ + 0.3 * (end - begin) : end - begin;
  stamp_text_.clear();
  if (const auto& offset = mapper_->health().stamp_offset; offset && offset->is_certain())
    stamp_text_ =
        fmt::format("the images' stamps are {:.1f} ms {}: add {:.4f} to time_offset",
                    1e3 * std::abs(offset->seconds), offset->seconds < 0 ? "late" : "early", offset->seconds);
  come_.notify_all();
}

void Running::tell(const WaitingFrame& frame, const PoseReply& reply, const MapperUpdate& update,
                   const cv::Mat& image) {
  const Wanted wanted = sink_.wanted();
  FrameResult out;
  out.stamp = frame.message.stamp;
  out.world_frame = poses_->world();
  out.camera_frame = camera_frame(frame.message);
  if (options_.poses == PoseKind::sensors) {
    out.body_frame = frame_name(options_.base_frame);
    out.T_world_body = placement_of(reply.T_world_body);
  }
  const pade::DepthImage& depth = update.depth;
  const cv::Mat z = depth.depth.isContinuous() ? depth.depth : depth.depth.clone();
  out.width = z.cols;
  out.height = z.rows;
  out.depth = z.ptr<float>();
  if (wanted.sigma) {
    cv::Mat sigma;
    cv::sqrt(depth.variance, sigma);
    out.sigma.assign(sigma.begin<float>(), sigma.end<float>());
  }
  const Pose& T_world_camera = update.reference.T_world_camera;
  if (wanted.cloud) {
    const pade::Camera& camera = mapper_->camera();
    const Eigen::Matrix3d R = T_world_camera.matrix3();
    const double most = options_.mapper.map.hit_max_relative_sigma;
    for (int v = 0; v < z.rows; v += options_.cloud_step) {
      const auto* const row = z.ptr<float>(v);
      const auto* const variance = depth.variance.empty() ? nullptr : depth.variance.ptr<float>(v);
      for (int u = 0; u < z.cols; u += options_.cloud_step) {
        const double d = static_cast<double>(row[u]);
        const double sigma = variance == nullptr ? 0 : std::sqrt(static_cast<double>(variance[u]));
        if (!(d <= options_.mapper.map.range) || sigma > most * d) continue;
        const Eigen::Vector3d point =
            R * Eigen::Vector3d(d * (u - camera.cx) / camera.fx, d * (v - camera.cy) / camera.fy, d) +
            T_world_camera.translation;
        CloudPoint p{static_cast<float>(point.x()), static_cast<float>(point.y()),
                     static_cast<float>(point.z()), static_cast<float>(sigma)};
        if (image.channels() == 3) {
          const auto& bgr = image.at<cv::Vec3b>(v, u);
          p.b = bgr[0];
          p.g = bgr[1];
          p.r = bgr[2];
        } else {
          p.r = p.g = p.b = image.at<std::uint8_t>(v, u);
        }
        out.cloud.push_back(p);
      }
    }
  }
  constexpr std::size_t kMostPoses = 1000;
  if (path_left_out_++ % path_step_ == 0)
    path_.push_back({out.stamp, placement_of(mapper_->T_world_camera())});
  if (path_.size() > kMostPoses) {
    std::vector<PathPose> half;
    for (std::size_t i = 0; i < path_.size(); i += 2) half.push_back(path_[i]);
    path_ = std::move(half);
    path_step_ *= 2;
  }
  out.path = &path_;
  sink_.frame(out);
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
      if (steady_seconds() < last + period) continue;
      view = view_;
      is_new = view_new_;
      head.stamp = view_stamp_;
      head.world_frame = view_world_;
    }
    const Wanted wanted = sink_.wanted();
    const bool more = (wanted.binary && !before.binary) || (wanted.full && !before.full) ||
                      (wanted.voxels && !before.voxels) || (wanted.projected && !before.projected);
    if (!is_new && !more) continue;
    if (head.world_frame.empty()) continue;  // nothing was ever mapped
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
    side_car = pade::io::encode_side_car(options_.mapper.map, std::nullopt);
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

Diagnosis Running::diagnose_camera(double now) {
  Diagnosis out{Diagnosis::ok, "camera", fmt::format("{:.1f} Hz", counts_.images.hertz(now)), {}};
  const std::size_t mapped = counts_.mapped.count();
  if (counts_.images.count() == 0) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no image on {}", topics_.image);
  } else if (counts_.images.silence(now) > 1) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no image on {} for {:.1f} s", topics_.image, counts_.images.silence(now));
  }
  out.values = {{"topic", topics_.image},
                {"rate_hz", fmt::format("{:.1f}", counts_.images.hertz(now))},
                {"received", fmt::format("{}", counts_.images.count())},
                {"mapped", fmt::format("{}", mapped)},
                {"skipped", fmt::format("{}", counts_.skipped)},
                {"dropped", fmt::format("{}", counts_.dropped)},
                {"waiting", fmt::format("{}", waiting_.size())}};
  for (const auto& [reason, count] : counts_.reasons)
    out.values.emplace_back(fmt::format("skipped: {}", reason), fmt::format("{}", count));
  return out;
}

Diagnosis Running::diagnose_calibration(double now) {
  Diagnosis out{Diagnosis::ok, "camera_info", "", {}};
  if (counts_.infos.count() == 0) {
    out.level = Diagnosis::error;
    out.message = fmt::format("no sensor_msgs/CameraInfo on {}", topics_.camera_info);
  } else if (!eye_) {
    out.level = Diagnosis::error;
    out.message = fmt::format("{}: {}", topics_.camera_info, eye_problem_);
  } else {
    out.message = fmt::format("{} x {}", eye_->lens.width, eye_->lens.height);
    // Of every image that is not compressed the size is known.
    if (!waiting_.empty() && !waiting_.back().message.compressed &&
        (waiting_.back().message.width != info_->width || waiting_.back().message.height != info_->height)) {
      out.level = Diagnosis::error;
      out.message = fmt::format("it is for {} x {} pixels, and the images have {} x {}", info_->width,
                                info_->height, waiting_.back().message.width, waiting_.back().message.height);
    }
  }
  out.values = {{"topic", topics_.camera_info},
                {"received", fmt::format("{}", counts_.infos.count())},
                {"rate_hz", fmt::format("{:.1f}", counts_.infos.hertz(now))}};
  return out;
}

Diagnosis Running::diagnose_mapper(double now) {
  Diagnosis out{Diagnosis::ok, "mapper", fmt::format("{:.1f} Hz", counts_.mapped.hertz(now)), {}};
  if (counts_.mapped.count() == 0) {
    out.level = Diagnosis::error;
    out.message = "nothing is mapped yet";
  } else if (counts_.mapped.silence(now) > 1) {
    out.level = Diagnosis::error;
    out.message = fmt::format("nothing was mapped for {:.1f} s", counts_.mapped.silence(now));
  } else if (counts_.last_depth < now - 1) {
    out.level = Diagnosis::warning;
    out.message = "no depth: no parallax (hover?) or no texture";
  } else if (!stamp_text_.empty()) {
    out.level = Diagnosis::warning;
    out.message = stamp_text_;
  }
  out.values = {{"rate_hz", fmt::format("{:.1f}", counts_.mapped.hertz(now))},
                {"mapped", fmt::format("{}", counts_.mapped.count())},
                {"latency_ms", fmt::format("{:.1f}", 1e3 * counts_.latency.quantile(0.5))},
                {"latency_95_ms", fmt::format("{:.1f}", 1e3 * counts_.latency.quantile(0.95))},
                {"work_ms", fmt::format("{:.1f}", 1e3 * counts_.work.quantile(0.5))},
                {"depth_share", fmt::format("{:.2f}", counts_.depth_share)},
                {"begun_anew", fmt::format("{}", counts_.restarts)},
                {"last_begun_anew", counts_.last_restart}};
  return out;
}

std::vector<Diagnosis> Running::diagnose() {
  const double now = steady_seconds();
  std::vector<Diagnosis> out;
  Diagnosis poses = poses_->diagnose(now);
  {
    const std::lock_guard lock(mutex_);
    out.push_back(diagnose_camera(now));
    out.push_back(diagnose_calibration(now));
    out.push_back(std::move(poses));
    out.push_back(diagnose_mapper(now));
  }
  for (const Diagnosis& one : out) {
    if (one.level != Diagnosis::ok && one.name != "mapper")
      say(one.level, fmt::format("{}: {}", one.name, one.message));
  }
  return out;
}

}  // namespace

double Recent::quantile(double share) const {
  if (values_.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted(values_.begin(), values_.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
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
