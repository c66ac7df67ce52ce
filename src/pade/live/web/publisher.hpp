// What a session gives to its clients: kept here as the mapper leaves it, made into messages when a client
// can take one. So a client that takes nothing costs nothing, and of what it missed only the newest is left.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/sectors.hpp"
#include "pade/live/web/channels.hpp"
#include "pade/live/web/session_health.hpp"
#include "pade/live/web/thinned_path.hpp"
#include "pade/live/web/voxel_log.hpp"

namespace pade::live {

/// What Publisher asks for a few times a second, in the server's thread. `latency`, `latency_95`, `occupied`
/// and `web` are filled in by others.
using HealthQuestion = std::function<HealthInputs()>;

/// How messages call times and frames.
struct MessageTerms {
  std::string world = io::flight_names::world_frame, body = io::flight_names::body_frame,
              camera = io::flight_names::camera_frame;
  std::string map = "pade_map";       ///< the map's world, where it has an origin of its own (LiveUpdate)
  std::function<Time(Time)> stamp{};  ///< of a time of ours; empty: the same
  bool states_body = true;            ///< the transforms say where the body is in the world
  bool states_camera = true;          ///< and how the camera sits on it

  /// @param origin  of the map in the world of the poses
  [[nodiscard]] const std::string& world_of(const Eigen::Vector3d& origin) const {
    return origin.isZero(0) ? world : map;
  }
  [[nodiscard]] io::MessageHeader header(Time time, const std::string& frame) const {
    return {stamp ? stamp(time) : time, frame};
  }
};

/// Takes results from the mapper's thread and makes messages in the server's.
class Publisher : public Sink {
 public:
  /// How far one client is. Zeros: it is new.
  struct Cursor {
    std::array<std::uint64_t, kWebChannels> sent{};  ///< version of each channel
    std::array<Time, kWebChannels> when{};           ///< it was sent
    std::size_t dropped = 0;                         ///< messages of frames that newer ones took the place of
  };
  /// A message of a channel.
  struct Message {
    Time time;
    std::shared_ptr<const std::string> bytes;
  };

  Publisher(const Camera& camera, const Pose& T_body_camera, const SectorOptions& sectors,
            HealthQuestion health);

  /// @{
  /// The mapper's thread. None of them waits for a client.
  void take(const LiveUpdate& update) override;
  void pass(const LiveFrame& frame) override;
  void forget(const std::shared_ptr<const mapping::MapView>& view, const mapping::MapChange& change) override;
  void begin_anew() override;
  void take_sectors(const std::array<std::uint16_t, kBins>& distances, Time frame);
  void take_counts(const SessionCounts& counts);
  /// @}

  /// Called after each change, by the thread that made it. To be set while nothing changes.
  void on_change(std::function<void()> wake);
  /// Asked for each message that is made. To be set while nothing changes.
  void call_things(std::function<MessageTerms()> terms) { terms_ = std::move(terms); }
  /// Whether anybody could take the images of a frame at once: those of others are not kept.
  void set_hungry(bool hungry) { hungry_ = hungry; }

  /// @{
  /// The server's thread.
  /// The next message of a channel for a client; none where it has the newest, or had one a moment ago.
  [[nodiscard]] std::optional<Message> next(WebChannel channel, Cursor& cursor);
  /// Messages of frames since the last one sent that the client will not get any more.
  [[nodiscard]] std::size_t missed(WebChannel channel, const Cursor& cursor) const;
  /// Makes the health anew, and sees what has changed in the map.
  void refresh(const WebCounts& web, bool with_map);
  [[nodiscard]] const io::Diagnosis& health() const { return health_; }
  /// @}

 private:
  /// A frame as it was mapped, or not. Nothing in it changes any more.
  struct Snapshot {
    std::uint64_t version = 0;
    Time time;
    std::optional<Pose> T_world_body;  ///< empty: it was not mapped
    Pose T_world_camera;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    cv::Mat image;     ///< of the depth's frame
    DepthImage depth;  ///< as it was estimated, in cells; empty where there is none
  };
  /// What was made of it last, for all clients that want the same.
  struct Made {
    std::uint64_t version = 0;
    Message message;
  };
  void publish(const std::shared_ptr<const Snapshot>& snapshot);
  void count_latency(double seconds);
  [[nodiscard]] std::shared_ptr<const std::string> of_frame(WebChannel channel,
                                                            const Snapshot& snapshot) const;
  [[nodiscard]] std::shared_ptr<const std::string> cloud_of(const Snapshot& snapshot) const;
  [[nodiscard]] std::optional<Message> next_voxels(Cursor& cursor);
  void update_voxels();
  [[nodiscard]] std::optional<Message> made(WebChannel channel, Cursor& cursor, std::uint64_t version,
                                            double pause, const std::function<Message()>& make);

  Camera camera_;
  Pose T_body_camera_;
  SectorOptions sector_options_;
  [[nodiscard]] MessageTerms terms() const { return terms_ ? terms_() : MessageTerms{}; }

  HealthQuestion question_;
  std::function<MessageTerms()> terms_;
  std::function<void()> wake_;
  std::atomic<bool> hungry_{false};

  mutable std::mutex mutex_;                // of what both threads use
  std::shared_ptr<const Snapshot> newest_;  // with images
  std::uint64_t frames_ = 0;                // versions of all, with images or without
  std::optional<std::pair<Time, Pose>> pose_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of pose, path and view
  std::uint64_t poses_ = 0;
  std::shared_ptr<const mapping::MapView> view_;
  Time view_time_;
  TouchedBlocks touched_;
  bool begun_anew_ = false;
  ThinnedPath path_;
  std::array<std::uint16_t, kBins> distances_{};
  Time distances_time_;
  std::uint64_t sectors_ = 0;
  SessionCounts counts_;
  std::vector<double> latencies_;  // of the last frames, a ring
  std::size_t latency_ = 0;        // of them, the oldest
  double depth_share_ = 0;

  // Of the server's thread.
  VoxelLog voxels_;
  Time voxels_time_;  // of the view
  Eigen::Vector3d voxels_origin_ = Eigen::Vector3d::Zero();
  io::Diagnosis health_;
  Time health_time_;
  std::uint64_t healths_ = 0;
  SessionHealth rates_;
  std::array<Made, kWebChannels> made_;
  std::uint64_t voxels_from_ = 0, voxels_to_ = 0;  // of the message in made_
};

}  // namespace pade::live
