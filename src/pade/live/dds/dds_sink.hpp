// What a session gives to ROS 2: messages over DDS, in a thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/live/dds/dds_shared.hpp"
#include "pade/live/dds/network.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/sectors.hpp"
#include "pade/live/web/publisher.hpp"

namespace pade::live {

/// What is known of a session when it begins to publish.
struct DdsSinkParts {
  Camera camera;  ///< undistorted
  Pose T_body_camera;
  SectorOptions sectors;
  bool states_body = true;    ///< nobody else says where the body is: the poses are not of ROS
  bool states_camera = true;  ///< nobody else says how the camera sits: the images are not of ROS
};

/// Publishes as long as it lives. A subscriber that takes nothing costs this thread up to 0.1 s for each
/// message, and the mapper nothing.
///
/// | topic | type | quality |
/// |---|---|---|
/// | /pade/cloud | sensor_msgs/PointCloud2 | sensor |
/// | /pade/depth, /pade/sigma | sensor_msgs/Image (32FC1) | sensor |
/// | /pade/camera_info | sensor_msgs/CameraInfo | sensor |
/// | /pade/sectors | sensor_msgs/LaserScan | sensor |
/// | /octomap_binary, /octomap_full | octomap_msgs/Octomap | latched |
/// | /octomap_point_cloud_centers | sensor_msgs/PointCloud2 | latched |
/// | /pade/path | nav_msgs/Path | latched |
/// | /tf | tf2_msgs/TFMessage | stream |
/// | /diagnostics | diagnostic_msgs/DiagnosticArray | stream |
class DdsSink : public Sink {
 public:
  /// Errors: those of DdsNetwork::writer.
  /// @param network  and `shared` must outlive it
  static Result<std::unique_ptr<DdsSink>> start(DdsNetwork& network, DdsShared& shared,
                                                const DdsOptions& options, const DdsSinkParts& parts,
                                                HealthQuestion health);
  ~DdsSink() override;
  DdsSink(const DdsSink&) = delete;
  DdsSink& operator=(const DdsSink&) = delete;

  /// @{
  /// The mapper's thread. None of them waits for a subscriber.
  void take(const LiveUpdate& update) override;
  void pass(const LiveFrame& frame) override;
  void forget(const std::shared_ptr<const mapping::MapView>& view, const mapping::MapChange& change) override;
  void begin_anew() override;
  void take_sectors(const std::array<std::uint16_t, kBins>& distances, Time frame);
  void take_counts(const SessionCounts& counts);
  /// @}

  /// For the log: subscribers, messages, and who asks for what is not offered. Any thread.
  [[nodiscard]] std::string text() const;

 private:
  struct Topic {
    std::string name;
    std::unique_ptr<TopicWriter> writer;
    std::optional<WebChannel> channel;  ///< empty: a map
  };
  /// Of which topic a map is.
  enum class MapKind : std::uint8_t { binary, full, centres };
  struct MapTopic {
    MapKind kind;
    std::string name;
    std::unique_ptr<TopicWriter> writer;
    std::uint64_t sent = 0;  ///< version
    Time next{};             ///< not before
  };
  struct Newest {
    std::shared_ptr<const mapping::MapView> view;
    Time time;
    std::uint64_t version = 0;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< LiveUpdate
  };

  DdsSink(DdsShared& shared, const DdsOptions& options, const DdsSinkParts& parts, HealthQuestion health);
  Status open(DdsNetwork& network);
  void run();
  void publish_frames();
  void publish_map(Time now);
  [[nodiscard]] std::string map_message(MapKind kind, const Newest& map) const;
  void refresh(Time now);

  DdsShared& shared_;
  DdsOptions options_;
  DdsSinkParts parts_;
  Publisher publisher_;
  Publisher::Cursor cursor_;
  std::vector<Topic> topics_;
  std::vector<MapTopic> maps_;
  Time next_refresh_;

  mutable std::mutex mutex_;  // of all below
  std::condition_variable come_;
  bool changed_ = false, over_ = false;
  Newest newest_;
  std::string text_;
  std::thread thread_;
};

}  // namespace pade::live
