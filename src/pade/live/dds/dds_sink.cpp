#include "pade/live/dds/dds_sink.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <sys/resource.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/recording/messages/display_messages.hpp"
#include "pade/io/run/run_info.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

namespace pade::live {
namespace {

struct PublishedChannel {
  WebChannel channel;
  std::string_view topic;
  TopicQuality quality;
  bool common = false;  ///< one topic for all vehicles, whatever the namespace
};

constexpr std::array kPublished = {
    PublishedChannel{WebChannel::depth, "/pade/depth", TopicQuality::sensor},
    PublishedChannel{WebChannel::sigma, "/pade/sigma", TopicQuality::sensor},
    PublishedChannel{WebChannel::camera_info, "/pade/camera_info", TopicQuality::sensor},
    PublishedChannel{WebChannel::cloud, "/pade/cloud", TopicQuality::sensor},
    PublishedChannel{WebChannel::sectors, "/pade/sectors", TopicQuality::sensor},
    PublishedChannel{WebChannel::path, "/pade/path", TopicQuality::latched},
    PublishedChannel{WebChannel::transforms, "/tf", TopicQuality::stream, true},
    PublishedChannel{WebChannel::health, "/diagnostics", TopicQuality::stream, true},
};

/// The nodes behind the first line "data" of a map file are what is sent; a file is made either way.
std::string octomap(const io::MessageHeader& header, const mapping::MapView& view, io::MapFormat format) {
  const std::string file = io::bytes_of(io::encode_map(view, format));
  return io::write_octomap(header, file, view.voxel(), format == io::MapFormat::bt);
}

/// The centres of the occupied voxels.
std::string centres(const io::MessageHeader& header, const mapping::MapView& view) {
  std::vector<io::DisplayPoint> points;
  const double voxel = view.voxel();
  view.for_each_leaf([&](const mapping::MapLeaf& leaf) {
    if (!leaf.is_occupied) return;
    const std::uint64_t end = leaf.code + mapping::voxels_of(leaf.depth);
    for (std::uint64_t code = leaf.code; code < end; ++code) {
      const Eigen::Vector3f place = mapping::centre_of(mapping::morton_key(code), voxel).cast<float>();
      points.push_back({place.x(), place.y(), place.z(), 0});
    }
  });
  return io::write_point_cloud(header, points);
}

}  // namespace

DdsSink::DdsSink(DdsShared& shared, const DdsOptions& options, const DdsSinkParts& parts,
                 HealthQuestion health)
    : shared_(shared),
      options_(options),
      parts_(parts),
      publisher_(parts.camera, parts.T_body_camera, parts.sectors, std::move(health)) {
  publisher_.call_things([this] {
    const Frames frames = shared_.names.now();
    MessageTerms terms;
    terms.world = frames.world;
    terms.body = frames.body;
    terms.camera = frames.camera;
    terms.map = frames.map;
    terms.stamp = [this](Time ours) { return shared_.clock.to_stamp(ours); };
    terms.states_body = parts_.states_body;
    terms.states_camera = parts_.states_camera;
    return terms;
  });
  publisher_.on_change([this] {
    const std::lock_guard lock(mutex_);
    changed_ = true;
    come_.notify_one();
  });
}

Result<std::unique_ptr<DdsSink>> DdsSink::start(DdsNetwork& network, DdsShared& shared,
                                                const DdsOptions& options, const DdsSinkParts& parts,
                                                HealthQuestion health) {
  std::unique_ptr<DdsSink> sink(new DdsSink(shared, options, parts, std::move(health)));
  if (const Status status = sink->open(network); !status) return status.error();
  sink->thread_ = std::thread([raw = sink.get()] { raw->run(); });
  return sink;
}

Status DdsSink::open(DdsNetwork& network) {
  for (const PublishedChannel& published : kPublished) {
    const std::string name =
        published.common ? std::string(published.topic) : own_topic(options_, published.topic);
    const std::string_view type = web_channels[static_cast<std::size_t>(published.channel)].type;
    auto writer = network.writer(name, type, published.quality);
    if (!writer) return writer.error();
    topics_.push_back({name, std::move(*writer), published.channel});
  }
  constexpr std::string_view kOctomap = "octomap_msgs/Octomap";
  const struct {
    MapKind kind;
    std::string_view topic, type;
  } maps[] = {{MapKind::binary, "/octomap_binary", kOctomap},
              {MapKind::full, "/octomap_full", kOctomap},
              {MapKind::centres, "/octomap_point_cloud_centers", "sensor_msgs/PointCloud2"}};
  for (const auto& map : maps) {
    const std::string name = own_topic(options_, map.topic);
    auto writer = network.writer(name, map.type, TopicQuality::latched);
    if (!writer) return writer.error();
    maps_.push_back({map.kind, name, std::move(*writer)});
  }
  return {};
}

DdsSink::~DdsSink() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    come_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void DdsSink::take(const LiveUpdate& update) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = {update.view, update.time, newest_.version + 1, update.origin};
  }
  publisher_.take(update);
}

void DdsSink::pass(const LiveFrame& frame) { publisher_.pass(frame); }

void DdsSink::begin_anew() {
  publisher_.begin_anew();
  const std::lock_guard lock(mutex_);
  newest_ = {nullptr, now_of_ours(), newest_.version + 1, newest_.origin};
}

void DdsSink::forget(const std::shared_ptr<const mapping::MapView>& view, const mapping::MapChange& change) {
  publisher_.forget(view, change);
  const std::lock_guard lock(mutex_);
  newest_.view = view;
  ++newest_.version;
}

void DdsSink::take_sectors(const std::array<std::uint16_t, kBins>& distances, Time frame) {
  publisher_.take_sectors(distances, frame);
}

void DdsSink::take_counts(const SessionCounts& counts) { publisher_.take_counts(counts); }

void DdsSink::run() {
  constexpr int kBehind = 5;
  (void)::setpriority(PRIO_PROCESS, 0, kBehind);  // this thread's: the mapper goes first
  constexpr auto kRound = std::chrono::milliseconds(50);
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      come_.wait_for(lock, kRound, [&] { return changed_ || over_; });
      if (over_) return;
      changed_ = false;
    }
    const Time now = now_of_ours();
    if (now >= next_refresh_) refresh(now);
    publish_frames();
    publish_map(now);
  }
}

void DdsSink::refresh(Time now) {
  constexpr std::int64_t kPause = 250'000'000;  // ns
  next_refresh_ = {now.nanoseconds + kPause};
  publisher_.refresh({}, true);
  std::string text;
  std::size_t subscribers = 0, sent = 0, failed = 0;
  const auto add = [&](TopicWriter& writer) {
    const TopicReport report = writer.report();
    subscribers += report.peers;
    sent += report.count;
    failed += report.failed;
    if (!report.mismatch.empty()) text += fmt::format("; {}", report.mismatch);
  };
  for (const Topic& topic : topics_) add(*topic.writer);
  for (const MapTopic& topic : maps_) add(*topic.writer);
  text = fmt::format("{} subscriptions, {} messages sent, {} not taken in time{}", subscribers, sent, failed,
                     text);
  const std::lock_guard lock(mutex_);
  text_ = std::move(text);
}

/// Of each topic the newest message, where anybody wants it: what nobody wants is not made.
void DdsSink::publish_frames() {
  bool hungry = false;
  for (const Topic& topic : topics_) {
    if (topic.writer->subscribers() == 0) continue;
    hungry = hungry || web_channels[static_cast<std::size_t>(*topic.channel)].of_a_frame;
    if (const auto message = publisher_.next(*topic.channel, cursor_)) topic.writer->write(*message->bytes);
  }
  publisher_.set_hungry(hungry);
}

/// A map is made for its subscribers when it has changed; who comes later is given it by DDS. One in a round,
/// so that frames and health go on meanwhile.
void DdsSink::publish_map(Time now) {
  Newest newest;
  {
    const std::lock_guard lock(mutex_);
    newest = newest_;
  }
  const auto due = [&](MapTopic& topic) {
    return topic.sent != newest.version && now >= topic.next && topic.writer->subscribers() > 0;
  };
  const auto next = std::find_if(maps_.begin(), maps_.end(), due);
  if (newest.version == 0 || next == maps_.end()) return;
  const double begun = io::thread_cpu_seconds();
  if (next->writer->write(map_message(next->kind, newest))) next->sent = newest.version;
  // A large map may take a tenth of a processor at most.
  constexpr double kShare = 10;
  const double pause = std::max(options_.map_period, kShare * (io::thread_cpu_seconds() - begun));
  next->next = {now.nanoseconds + static_cast<std::int64_t>(pause * 1e9)};
  // The others have their turn before it.
  std::rotate(next, next + 1, maps_.end());
}

std::string DdsSink::map_message(MapKind kind, const Newest& map) const {
  const Frames frames = shared_.names.now();
  const io::MessageHeader header{shared_.clock.to_stamp(map.time),
                                 map.origin.isZero(0) ? frames.world : frames.map};
  if (!map.view) {  // it has begun anew
    const double any = 1;
    if (kind == MapKind::centres) return io::write_point_cloud(header, {});
    return io::write_octomap(header, {}, any, kind == MapKind::binary);
  }
  switch (kind) {
    case MapKind::binary:
      return octomap(header, *map.view, io::MapFormat::bt);
    case MapKind::full:
      return octomap(header, *map.view, io::MapFormat::ot);
    case MapKind::centres:
      return centres(header, *map.view);
  }
  return {};
}

std::string DdsSink::text() const {
  const std::lock_guard lock(mutex_);
  return text_;
}

}  // namespace pade::live
