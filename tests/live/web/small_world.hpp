// A mapper's results made by hand: a wall that comes nearer, seen by a small camera.
#pragma once

#include <cmath>
#include <utility>

#include <opencv2/core.hpp>

#include "pade/live/camera/folder_source.hpp"
#include "pade/live/interfaces.hpp"
#include "pade/live/web/publisher.hpp"

#include "live/wall_camera.hpp"

namespace pade::live {

inline Pose forward_mounting() {
  Pose mounting;
  mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
  return mounting;
}

/// Frames one after the other, as a session would give them to a sink.
class SmallWorld {
 public:
  explicit SmallWorld(cv::Size size = {96, 64}) : camera_(small_camera()) {
    const double scale = static_cast<double>(size.width) / camera_.width;
    camera_.width = size.width;
    camera_.height = size.height;
    for (double* const value : {&camera_.fx, &camera_.fy, &camera_.cx, &camera_.cy}) *value *= scale;
    mapping::MapOptions options;
    options.looks_baseline = 0;  // one look is enough
    options.forget_after = 30;
    renew(options);
    mapped_.reference.image = cv::Mat(size, CV_8UC1, cv::Scalar(90));
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const mapping::OccupancyMap& map() const { return *map_; }

  int window = 1;                                    ///< of the depth
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the map
  /// A wall so far ahead, seen from a place of the body.
  void give(Sink& sink, double distance, const Eigen::Vector3d& place) {
    LiveUpdate update;
    update.time = now_of_ours();
    update.T_world_body.translation = place;
    const Pose T_world_camera = camera_pose(update.T_world_body, forward_mounting());
    mapped_.depth.time = update.time;
    mapped_.depth.window = window;
    const cv::Size cells((camera_.width + window - 1) / window, (camera_.height + window - 1) / window);
    mapped_.depth.depth = cv::Mat(cells, CV_32FC1, cv::Scalar(distance));
    mapped_.depth.depth.colRange(0, cells.width / 4) = NAN;
    mapped_.depth.variance = cv::Mat(cells, CV_32FC1, cv::Scalar(0.01));
    mapped_.depth.variance.colRange(0, cells.width / 4) = NAN;
    update.origin = origin;
    mapped_.reference.T_world_camera = T_world_camera;
    mapped_.change = map_->integrate(mapped_.depth, camera_, T_world_camera);
    view_ = view_ ? view_->after(*map_, mapped_.change) : mapping::MapView::of(*map_);
    update.view = view_;
    update.depth_share = 0.75;
    update.image = mapped_.reference.image.clone();
    update.mapped = &mapped_;
    sink.take(update);
  }
  /// A minute passes in which nothing is mapped.
  void forget(Sink& sink) {
    const mapping::MapChange change = map_->forget({mapped_.depth.time.nanoseconds + 60'000'000'000});
    view_ = view_->after(*map_, change);
    sink.forget(view_, change);
  }
  /// The map is empty again.
  void begin_anew(Sink& sink) {
    renew(mapping::MapOptions(map_->options()));
    view_.reset();
    sink.begin_anew();
  }
  [[nodiscard]] const std::shared_ptr<const mapping::MapView>& view() const { return view_; }
  [[nodiscard]] const MapperUpdate& mapped() const { return mapped_; }

 private:
  void renew(const mapping::MapOptions& options) {
    auto made = mapping::OccupancyMap::create(options);
    map_.emplace(std::move(*made));
  }
  Camera camera_;
  std::optional<mapping::OccupancyMap> map_;
  std::shared_ptr<const mapping::MapView> view_;
  MapperUpdate mapped_;
};

/// What a publisher asks, of a session in which nothing is missing.
inline HealthInputs healthy() {
  HealthInputs inputs;
  inputs.now = now_of_ours();
  inputs.image = inputs.depth = inputs.now.nanoseconds;
  inputs.link.missing = Missing::nothing;
  inputs.missing = "obstacle mapping active";
  return inputs;
}

}  // namespace pade::live
