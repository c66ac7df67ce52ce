// A camera's picture from any pose at any time: light, motion blur, and what the sensor makes of it.
#pragma once

#include <cstdint>
#include <functional>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/simulation/render/image_formation.hpp"
#include "pade/simulation/render/renderer.hpp"

namespace pade::simulation {

struct FrameOptions {
  ImageOptions image;
  RenderOptions render;
  double exposure_time = 0;  ///< s; motion blur if it is not 0
  int blur_samples = 8;      ///< pictures that are averaged over the exposure
  std::uint64_t seed = 1;    ///< of the noise
  int threads = 1;           ///< the same bits for any number
};

/// Makes frames of one camera in one scene, which must outlive it.
class FrameMaker {
 public:
  FrameMaker(const Scene& scene, const Camera& camera, const FrameOptions& options);

  /// Where the camera is (T_world_camera) `offset` seconds after mid exposure; asked for within the exposure.
  using PoseAt = std::function<Pose(double offset)>;
  /// The light of a frame whose mid exposure is at `T_world_camera`, and the exact depth from there.
  /// `pose_at` is not called without motion blur.
  [[nodiscard]] Rendering expose(const Pose& T_world_camera, const PoseAt& pose_at) const;
  /// The image that the sensor makes of it: CV_8UC1, or CV_8UC3 (BGR) where the options ask for colour. The
  /// time seeds the noise: frames do not depend on each other.
  [[nodiscard]] cv::Mat picture(const Rendering& light, Time time) const;

  [[nodiscard]] const RayGrid& grid() const { return grid_; }

 private:
  const Scene& scene_;
  FrameOptions options_;
  RayGrid grid_;
  Renderer renderer_;
};

}  // namespace pade::simulation
