// What a live session is put together from: where frames come from, where poses come from, where results go.
// Times are those of our monotonic clock.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/live/link/pose_source.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade::live {

/// An image as the mapper takes it.
struct LiveFrame {
  cv::Mat image;  ///< 8 bit, grey or BGR, undistorted; nobody else writes into it
  Time time;      ///< start of the exposure
};

/// A camera, or what stands for one. One thread.
class FrameSource {
 public:
  /// What became of a question for the next frame.
  enum class Outcome : unsigned char {
    frame,    ///< here it is
    nothing,  ///< none came in time; ask again
    ended,    ///< none will come any more
  };
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Waits for the next frame, at most so long, ms. A camera that was lost is opened again here.
  virtual Outcome next(LiveFrame& frame, int milliseconds) = 0;
  /// The pinhole camera of its frames.
  [[nodiscard]] virtual const Camera& camera() const = 0;
  /// CV_8UC1, 0 where no frame sees anything; empty: all valid.
  [[nodiscard]] virtual cv::Mat mask() const = 0;
  /// Why no frame comes, where it is known; the thread of next().
  [[nodiscard]] virtual std::string remark() const { return {}; }
  /// How far the times of its newest frames lie behind ours, beside what a frame takes to come: a recording
  /// that is played at half its pace falls behind by half a second in each. s; any thread.
  [[nodiscard]] virtual double behind() const { return 0; }
};

/// Where the vehicle was. Any thread.
class NavigationSource {
 public:
  NavigationSource() = default;
  NavigationSource(const NavigationSource&) = delete;
  NavigationSource& operator=(const NavigationSource&) = delete;
  virtual ~NavigationSource() = default;

  /// The pose of the body at a time.
  [[nodiscard]] virtual PoseAnswer pose_at(Time time) const = 0;
  /// Covariance of the camera's motion between two times, as Frame::motion_covariance has it. Empty where the
  /// source does not know it.
  [[nodiscard]] virtual std::optional<Matrix6d> motion_covariance(Time /*t1*/, Time /*t2*/,
                                                                  const Pose& /*T_body_camera*/) const {
    return std::nullopt;
  }
};

/// What a frame has changed.
struct LiveUpdate {
  Time time;                                     ///< of the frame
  Pose T_world_body;                             ///< in the map's world
  std::shared_ptr<const mapping::MapView> view;  ///< constant; may be kept
  double depth_share = 0;                        ///< of the pixels that have a depth
  cv::Mat image{};                               ///< as LiveFrame::image; may be kept
  /// What the mapper did; valid until the sink returns, so clone what is to be kept. Not null in a session.
  const MapperUpdate* mapped = nullptr;
  /// Where the 0 0 0 of the map's world is in the world of the poses, m: there as well, unless the vehicle
  /// has come so far that a map from there would end around it.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double behind = 0;  ///< FrameSource::behind()
};

/// A frame as it goes into the mapper.
struct MapperInput {
  cv::Mat image;  ///< as LiveFrame::image
  Time time;
  Pose T_world_camera;
  Matrix6d covariance;  ///< of the motion since the frame before (Frame::motion_covariance)
};

/// Takes what is mapped. Called by the mapper's thread, so it must not wait.
class InputSink {
 public:
  InputSink() = default;
  InputSink(const InputSink&) = delete;
  InputSink& operator=(const InputSink&) = delete;
  virtual ~InputSink() = default;

  virtual void take(const MapperInput& input) = 0;
  /// As Sink::begin_anew(): what comes now is another map.
  virtual void begin_anew() = 0;
};

/// Takes results. Called by the mapper's thread, so it must not wait.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  virtual void take(const LiveUpdate& update) = 0;
  /// A frame that the map has nothing of: without a pose or a partner, or unusable.
  virtual void pass(const LiveFrame& /*frame*/) {}
  /// A frame that was left out has made the map forget what nobody saw again (MapOptions::forget_after).
  /// @param view  of the map now
  virtual void forget(const std::shared_ptr<const mapping::MapView>& /*view*/,
                      const mapping::MapChange& /*change*/) {}
  /// The poses have jumped, or the vehicle has come too far: what comes from now on is in another world, and
  /// the map is empty.
  virtual void begin_anew() {}
};

}  // namespace pade::live
