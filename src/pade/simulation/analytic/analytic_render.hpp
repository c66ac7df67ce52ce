// What a camera sees in an analytic scene: images, and the exact depth, flow and visibility that belong to
// them.
#pragma once

#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"
#include "pade/simulation/analytic/analytic_scene.hpp"

namespace pade::simulation {

/// How an image is taken. The options of the sensor only; depth and flow are exact.
struct AnalyticRenderOptions {
  int samples = 2;               ///< at edges of surfaces a pixel is the mean of samples x samples rays
  double noise_sigma = 0;        ///< standard deviation of the sensor noise, grey levels
  std::uint64_t noise_seed = 0;  ///< give each frame its own; same seed, same noise
  int threads = 1;               ///< rows are shared among them; the result does not depend on it

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("samples", self.samples, "n of the n x n rays per pixel at edges");
    field("noise_sigma", self.noise_sigma, "standard deviation of the sensor noise, grey levels");
  }
};

/// Grey image of an undistorted or distorted camera. CV_8UC1; pixels outside the lens are 0.
cv::Mat render_image(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                     const AnalyticRenderOptions& options = {});

/// Exact Z-depth at each pixel centre. CV_32FC1, metres; NaN = sky or outside the lens.
cv::Mat exact_depth(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                    int threads = 1);

/// What each pixel centre sees: 0 = sky or outside the lens, i + 1 = surface i. CV_8UC1 (at most 254
/// surfaces).
cv::Mat exact_labels(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                     int threads = 1);

/// 255 where a label belongs to a surface that carries texture, 0 on blank surfaces and sky. CV_8UC1.
cv::Mat textured_mask(const AnalyticScene& scene, const cv::Mat& labels);

/// Exact flow from one pixel of the camera at T_world_from to where the same surface point (or, for the sky,
/// the same direction) appears at T_world_to.
struct ExactFlow {
  Eigen::Vector2d vector = Eigen::Vector2d::Zero();  ///< pixels
  bool visible = false;  ///< inside the other image and not hidden by another surface
};

/// Empty if the pixel is outside the lens or the point has no image in the other camera (behind it).
std::optional<ExactFlow> exact_flow_at(const AnalyticScene& scene, const Camera& camera,
                                       const Pose& T_world_from, const Pose& T_world_to,
                                       const Eigen::Vector2d& pixel);

/// exact_flow_at() for every pixel centre.
struct ExactFlowField {
  FlowField
      flow;  ///< vectors also where the point is hidden or outside the other image; NaN where there is none
  cv::Mat visible;  ///< CV_8UC1, 255 = seen in both images
};
ExactFlowField exact_flow(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_from,
                          const Pose& T_world_to, int threads = 1);

}  // namespace pade::simulation
