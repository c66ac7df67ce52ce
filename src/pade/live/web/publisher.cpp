#include "pade/live/web/publisher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/web/pictures.hpp"
#include "pade/mapping/back_projection.hpp"

namespace pade::live {
namespace {

constexpr auto kCdr = io::MessageEncoding::cdr;
constexpr std::size_t kLatencies = 100;      // frames
constexpr std::size_t kMostVoxels = 20'000;  // of a message, some 40 bytes each
constexpr std::size_t kMostPoints = 20'000;  // of a cloud

std::size_t number_of(WebChannel channel) { return static_cast<std::size_t>(channel); }

std::shared_ptr<const std::string> shared(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

io::RangeScan scan_of(const std::array<std::uint16_t, kBins>& distances, const SectorOptions& options) {
  constexpr double kStep = kBinAngle * 3.14159265358979323846 / 180;
  constexpr double kMetre = 100;  // cm
  io::RangeScan scan{0, kStep, options.min_distance, options.max_distance, {}};
  const double farthest = kMetre * options.max_distance;
  for (std::size_t i = 0; i < kBins; ++i) {
    const std::uint16_t distance = distances[(kBins - i) % kBins];  // bins go clockwise
    float range = static_cast<float>(distance / kMetre);
    if (distance == kUnknownDistance) {
      range = std::numeric_limits<float>::quiet_NaN();
    } else if (distance > farthest) {
      range = std::numeric_limits<float>::infinity();
    }
    scan.ranges.push_back(range);
  }
  return scan;
}

}  // namespace

Publisher::Publisher(const Camera& camera, const Pose& T_body_camera, const SectorOptions& sectors,
                     HealthQuestion health)
    : camera_(camera),
      T_body_camera_(T_body_camera),
      sector_options_(sectors),
      question_(std::move(health)) {}

void Publisher::on_change(std::function<void()> wake) {
  const std::lock_guard lock(mutex_);
  wake_ = std::move(wake);
}

void Publisher::count_latency(double seconds) {
  if (latencies_.size() < kLatencies) {
    latencies_.push_back(seconds);
  } else {
    latencies_[latency_] = seconds;
    latency_ = (latency_ + 1) % kLatencies;
  }
}

void Publisher::publish(const std::shared_ptr<const Snapshot>& snapshot) {
  std::function<void()> wake;
  {
    const std::lock_guard lock(mutex_);
    ++frames_;
    if (snapshot) newest_ = snapshot;
    wake = wake_;
  }
  if (wake) wake();
}

void Publisher::take(const LiveUpdate& update) {
  std::shared_ptr<Snapshot> snapshot;
  if (hungry_ && update.mapped != nullptr) {
    const MapperUpdate& mapped = *update.mapped;
    snapshot = std::make_shared<Snapshot>();
    const bool same = mapped.depth.time == update.time;  // else the depth belongs to an older frame
    snapshot->time = mapped.depth.time;
    snapshot->image = same ? update.image : mapped.reference.image.clone();
    snapshot->depth.window = mapped.depth.window;
    snapshot->depth.depth = mapped.depth.depth.clone();
    snapshot->depth.variance = mapped.depth.variance.clone();
    snapshot->origin = update.origin;
    snapshot->T_world_body = update.T_world_body;
    snapshot->T_world_camera = mapped.reference.T_world_camera;
  }
  {
    const std::lock_guard lock(mutex_);
    if (snapshot) snapshot->version = frames_ + 1;
    pose_ = {update.time, update.T_world_body};
    ++poses_;
    origin_ = update.origin;
    path_.add({update.time, update.T_world_body});
    view_ = update.view;
    view_time_ = update.time;
    if (update.mapped != nullptr) add_touched(update.mapped->change, touched_);
    depth_share_ = update.depth_share;
    count_latency(seconds_between(update.time, now_of_ours()) - update.behind);
  }
  publish(snapshot);
}

void Publisher::pass(const LiveFrame& frame) {
  std::shared_ptr<Snapshot> snapshot;
  if (hungry_) {
    snapshot = std::make_shared<Snapshot>();
    snapshot->time = frame.time;
    snapshot->image = frame.image;
    const std::lock_guard lock(mutex_);
    snapshot->version = frames_ + 1;
  }
  publish(snapshot);
}

void Publisher::forget(const std::shared_ptr<const mapping::MapView>& view,
                       const mapping::MapChange& change) {
  const std::lock_guard lock(mutex_);
  view_ = view;
  add_touched(change, touched_);
}

void Publisher::begin_anew() {
  const std::lock_guard lock(mutex_);
  path_.begin_anew();
  touched_.clear();
  view_.reset();
  begun_anew_ = true;
}

void Publisher::take_sectors(const std::array<std::uint16_t, kBins>& distances, Time frame) {
  const std::lock_guard lock(mutex_);
  distances_ = distances;
  distances_time_ = frame;
  ++sectors_;
}

void Publisher::take_counts(const SessionCounts& counts) {
  const std::lock_guard lock(mutex_);
  counts_ = counts;
}

/// The message of a version, made once for all clients; none if this client has it.
std::optional<Publisher::Message> Publisher::made(WebChannel channel, Cursor& cursor, std::uint64_t version,
                                                  double pause, const std::function<Message()>& make) {
  const std::size_t i = number_of(channel);
  const Time now = now_of_ours();
  if (version == 0 || cursor.sent[i] == version) return std::nullopt;
  if (cursor.sent[i] != 0 && seconds_between(cursor.when[i], now) < pause) return std::nullopt;
  if (made_[i].version != version) made_[i] = {version, make()};
  if (web_channels[i].of_a_frame && cursor.sent[i] != 0) cursor.dropped += version - cursor.sent[i] - 1;
  cursor.sent[i] = version;
  cursor.when[i] = now;
  return made_[i].message;
}

std::size_t Publisher::missed(WebChannel channel, const Cursor& cursor) const {
  const std::uint64_t sent = cursor.sent[number_of(channel)];
  if (!web_channels[number_of(channel)].of_a_frame || sent == 0) return 0;
  const std::lock_guard lock(mutex_);
  return frames_ <= sent ? 0 : frames_ - sent - 1;
}

std::shared_ptr<const std::string> Publisher::cloud_of(const Snapshot& snapshot) const {
  const MessageTerms called = terms();
  std::vector<io::DisplayPoint> points;
  if (!snapshot.depth.empty()) {
    const auto every = std::sqrt(static_cast<double>(snapshot.depth.depth.total()) / kMostPoints);
    const PointCloud cloud = mapping::back_project(snapshot.depth, camera_, snapshot.T_world_camera, {},
                                                   std::max(1, static_cast<int>(std::ceil(every))));
    for (const CloudPoint& point : cloud) points.push_back({point.x, point.y, point.z, point.sigma});
  }
  return shared(
      io::write_point_cloud(called.header(snapshot.time, called.world_of(snapshot.origin)), points));
}

std::shared_ptr<const std::string> Publisher::of_frame(WebChannel channel, const Snapshot& snapshot) const {
  const MessageTerms called = terms();
  const io::MessageHeader header = called.header(snapshot.time, called.camera);
  const auto compressed = [&](const cv::Mat& picture) {
    return shared(io::write_compressed_image(header, "jpeg", jpeg_of(picture), kCdr));
  };
  const auto none = [&] { return cv::Mat(snapshot.image.size(), CV_32FC1, cv::Scalar(NAN)); };
  // On the pixels of the camera, as the messages of an image and its calibration are.
  const auto whole = [&](const cv::Mat& cells) {
    if (snapshot.depth.window == 1 || cells.empty()) return cells;
    cv::Mat pixels(camera_.size(), CV_32FC1);
    for (int row = 0; row < pixels.rows; ++row)
      for (int column = 0; column < pixels.cols; ++column)
        pixels.at<float>(row, column) =
            cells.at<float>(row / snapshot.depth.window, column / snapshot.depth.window);
    return pixels;
  };
  const cv::Mat depth = whole(snapshot.depth.depth), variance = whole(snapshot.depth.variance);
  switch (channel) {
    case WebChannel::camera:
      return compressed(snapshot.image);
    case WebChannel::camera_info:
      return shared(io::write_camera_info(header, camera_, kCdr));
    case WebChannel::obstacles:
      return compressed(small_picture(obstacle_picture(snapshot.image, depth, variance)));
    case WebChannel::depth_picture:
      return compressed(small_picture(depth_picture(depth, variance, snapshot.image.size())));
    case WebChannel::depth:
      return shared(io::write_image(header, depth.empty() ? none() : depth, kCdr));
    case WebChannel::sigma: {
      cv::Mat sigma = none();
      if (!variance.empty()) cv::sqrt(variance, sigma);
      return shared(io::write_image(header, sigma, kCdr));
    }
    case WebChannel::cloud:
      return cloud_of(snapshot);
    default:
      return shared({});
  }
}

void Publisher::update_voxels() {
  TouchedBlocks touched;
  std::shared_ptr<const mapping::MapView> view;
  bool anew = false;
  {
    const std::lock_guard lock(mutex_);
    touched.swap(touched_);
    view = view_;
    voxels_time_ = view_time_;
    voxels_origin_ = origin_;
    anew = std::exchange(begun_anew_, false);
  }
  if (anew) voxels_.begin_anew();
  if (view && !touched.empty()) voxels_.update(std::move(view), touched);
}

std::optional<Publisher::Message> Publisher::next_voxels(Cursor& cursor) {
  const std::size_t i = number_of(WebChannel::voxels);
  if (cursor.sent[i] == 0) update_voxels();
  if (cursor.sent[i] == voxels_.newest()) return std::nullopt;
  const std::uint64_t from = cursor.sent[i];
  if (from != voxels_from_ || voxels_to_ == 0 || made_[i].version != voxels_.newest()) {
    std::uint64_t known = from;
    const auto markers = voxels_.since(known, kMostVoxels);
    const MessageTerms called = terms();
    const io::MessageHeader header = called.header(voxels_time_, called.world_of(voxels_origin_));
    made_[i] = {voxels_.newest(), {voxels_time_, shared(io::write_cubes(header, markers))}};
    voxels_from_ = from;
    voxels_to_ = known;
  }
  cursor.sent[i] = voxels_to_;
  return made_[i].message;
}

std::optional<Publisher::Message> Publisher::next(WebChannel channel, Cursor& cursor) {
  if (channel == WebChannel::voxels) return next_voxels(cursor);
  constexpr double kSlow = 0.4;  // s between messages that repeat all of what they say
  std::unique_lock lock(mutex_);
  switch (channel) {
    case WebChannel::transforms:
      if (const MessageTerms called = terms();
          !called.states_body && !called.states_camera && origin_.isZero(0))
        return std::nullopt;  // others say all of it
      return made(channel, cursor, poses_, 0, [&]() -> Message {
        const auto& [time, T_world_body] = *pose_;
        const MessageTerms called = terms();
        const std::string& map = called.world_of(origin_);
        std::vector<io::NamedTransform> transforms;
        if (called.states_body) transforms.push_back({called.header(time, map), called.body, T_world_body});
        if (!origin_.isZero(0))
          transforms.push_back(
              {called.header(time, called.world), map, {Eigen::Quaterniond::Identity(), origin_}});
        if (called.states_camera)
          transforms.push_back({called.header(time, called.body), called.camera, T_body_camera_});
        return {time, shared(io::write_transforms(transforms, kCdr))};
      });
    case WebChannel::path:
      return made(channel, cursor, path_.version(), kSlow, [&]() -> Message {
        const Time time = pose_ ? pose_->first : now_of_ours();
        const MessageTerms called = terms();
        std::vector<io::PathPose> poses = path_.poses();
        for (io::PathPose& pose : poses) pose.time = called.header(pose.time, {}).stamp;
        return {time, shared(io::write_path(called.header(time, called.world_of(origin_)), poses))};
      });
    case WebChannel::sectors:
      return made(channel, cursor, sectors_, 0, [&]() -> Message {
        const MessageTerms called = terms();
        return {distances_time_, shared(io::write_range_scan(called.header(distances_time_, called.body),
                                                             scan_of(distances_, sector_options_)))};
      });
    case WebChannel::health:
      return made(channel, cursor, healths_, 0, [&]() -> Message {
        return {health_time_, shared(io::write_diagnosis(terms().header(health_time_, {}), health_))};
      });
    default:
      break;
  }
  const std::shared_ptr<const Snapshot> snapshot = newest_;
  if (!snapshot) return std::nullopt;
  const std::size_t i = number_of(channel);
  if (made_[i].version != snapshot->version && cursor.sent[i] != snapshot->version) {
    lock.unlock();  // the mapper need not wait for this
    const Made fresh{snapshot->version, {snapshot->time, of_frame(channel, *snapshot)}};
    lock.lock();
    made_[i] = fresh;
  }
  return made(channel, cursor, snapshot->version, 0, [&] { return made_[i].message; });
}

void Publisher::refresh(const WebCounts& web, bool with_map) {
  HealthInputs inputs = question_();
  if (with_map) update_voxels();
  const std::lock_guard lock(mutex_);
  inputs.counts = counts_;
  inputs.latency = quantile(latencies_, 0.5);
  inputs.latency_95 = quantile(latencies_, 0.95);
  inputs.depth_share = depth_share_;
  inputs.occupied = voxels_.occupied();
  inputs.web = web;
  health_ = rates_.of(inputs);
  health_time_ = inputs.now;
  ++healths_;
}

}  // namespace pade::live
