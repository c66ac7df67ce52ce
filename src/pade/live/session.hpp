// A live session: frames and poses in, map and sectors out, in threads that never wait for each other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/health.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/link/health.hpp"
#include "pade/live/sectors.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade::live {

/// How frames and poses meet.
struct SessionOptions {
  double hold = 0.2;              ///< a frame waits so long for its pose, s
  double time_offset = 0;         ///< time of a pose = time of the image + this, s
  double velocity_sigma = 0.1;    ///< of the autopilot's velocity, m/s: error of the way from frame to frame
  double rotation_sigma = 0.004;  ///< of its turn from frame to frame, rad; both 0: the images refine nothing
  double least_depth = 0.02;      ///< share of the pixels with depth below which a frame gave none

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("hold", self.hold, "a frame waits so long for its pose, s");
    field("time_offset", self.time_offset, "time of a pose = time of the image + this, s");
    field("velocity_sigma", self.velocity_sigma,
          "of the autopilot's velocity, m/s: error of the way from frame to frame");
    field("rotation_sigma", self.rotation_sigma,
          "of its turn from frame to frame, rad; both 0: the images refine nothing");
    field("least_depth", self.least_depth, "share of the pixels with depth below which a frame gave none");
  }
};
/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const SessionOptions& options);

/// What became of the frames: each counts once.
struct SessionCounts {
  std::size_t frames = 0;       ///< that the camera delivered
  std::size_t dropped = 0;      ///< for newer ones
  std::size_t skipped = 0;      ///< without a pose, or unusable
  std::size_t mapped = 0;       ///< all others, with the first of a map
  std::size_t mapped_anew = 0;  ///< of these, since the poses last jumped
  std::size_t restarts = 0;     ///< maps begun anew
  std::size_t borders = 0;  ///< of these, since the vehicle came near the border of what a map can address
  std::size_t outside = 0;  ///< points beyond it, which no map has
  std::map<std::string, std::size_t> reasons;  ///< of those skipped
};

/// Sectors to an autopilot, of each frame that gave depth.
class SectorSink : public Sink {
 public:
  /// @param view  what the camera sees of the bearings around the vehicle; of others nothing is said
  SectorSink(AutopilotLink& link, const SectorOptions& options, double least_depth,
             const SectorView& view = {})
      : link_(link), options_(options), least_depth_(least_depth), view_(view) {}
  void take(const LiveUpdate& update) override;
  /// Obstacles as points too, of what this camera sees.
  /// @param camera  undistorted
  void see_points(const Camera& camera, const Pose& T_body_camera) { eye_ = Eye{camera, T_body_camera}; }
  double time_offset = 0;  ///< time of the pose = time of the frame + this, s (SessionOptions)
  /// Told of all distances before they are turned to the newest heading; the mapper's thread. To be set
  /// before the session runs.
  std::function<void(const std::array<std::uint16_t, kBins>& distances, Time frame)> listener;

 private:
  AutopilotLink& link_;
  SectorOptions options_;
  struct Eye {
    Camera camera;
    Pose T_body_camera;
  };
  double least_depth_;
  SectorView view_;
  std::optional<Eye> eye_;
};

/// What a session works with; all must outlive it.
struct SessionParts {
  FrameSource& camera;
  const NavigationSource& poses;
  std::vector<Sink*> sinks;
  Progress& progress;             ///< written here, read by a link
  Pose T_body_camera;             ///< mounting of the camera
  InputSink* recorder = nullptr;  ///< what is mapped goes there as well
};

/// "the images' stamps are 12.0 ms late (1 sigma 0.5 ms): add -0.0120 to session.time_offset" if that is
/// certain, else empty.
std::string stamp_text(const std::optional<StampOffset>& offset);

/// Owns the mapper. One thread but where it says otherwise.
class Session {
 public:
  /// Errors: those of ObstacleMapper::create.
  static Result<Session> create(const SessionParts& parts, const SessionOptions& options,
                                const ObstacleMapperOptions& mapper);

  /// Runs camera and mapper, the one in a thread of its own and the other in this, until `stop` or the end of
  /// the camera.
  void run(const std::function<bool()>& stop);

  [[nodiscard]] const mapping::OccupancyMap& map() const { return mapper_.map(); }
  /// Where the map's 0 0 0 is in the world of the poses, m: there as well, unless the vehicle has come so far
  /// (32768 voxels less 200 m) that a map from there would end around it.
  [[nodiscard]] const Eigen::Vector3d& origin() const { return origin_; }
  /// While the session runs, for its own thread: as of when `stop` is asked.
  [[nodiscard]] const SessionCounts& counts() const { return counts_; }
  /// What the images say of their stamps against those of the poses.
  [[nodiscard]] const std::optional<StampOffset>& stamp_offset() const {
    return mapper_.health().stamp_offset;
  }

 private:
  Session(const SessionParts& parts, const SessionOptions& options, const ObstacleMapperOptions& mapper,
          ObstacleMapper made)
      : parts_(parts), options_(options), mapper_options_(mapper), mapper_(std::move(made)) {}
  bool map_next(std::vector<LiveFrame>& waiting, Time now);
  void pass_over_old(std::vector<LiveFrame>& waiting, Time now);
  [[nodiscard]] Time time_of_pose(Time frame) const;
  [[nodiscard]] PoseAnswer pose_of(const LiveFrame& frame) const;
  [[nodiscard]] Matrix6d covariance_of(const LiveFrame& frame) const;
  void map_frame(const LiveFrame& frame, const Pose& T_world_body);
  void skip(const std::string& reason);
  void pass(const LiveFrame& frame);
  void forget(Time now);
  void tell_forgotten(const mapping::MapChange& change);
  bool begin_anew();

  SessionParts parts_;
  SessionOptions options_;
  ObstacleMapperOptions mapper_options_;
  ObstacleMapper mapper_;
  std::shared_ptr<const mapping::MapView> view_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  bool any_frame_ = false;  // is in this map
  std::size_t jumps_ = 0;
  double busy_ = 0;  // that a frame took lately, s
  Time last_;        // frame that was mapped
  SessionCounts counts_;
};

}  // namespace pade::live
