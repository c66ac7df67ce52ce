// The picture of a scene as light: linear radiance per pixel from sun with shadows, sky light with ambient
// occlusion, and textured diffuse surfaces. What the sensor makes of it is image_formation.hpp.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/render/ray_grid.hpp"
#include "pade/simulation/render/scene.hpp"

namespace pade::simulation {

struct RenderOptions {
  /// Per pixel, 1 to 16; in pairs mirrored about the centre, so that their mean is the centre.
  int samples = 4;
  bool shadows = true;
  bool ambient_occlusion = true;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("samples", self.samples, "samples per pixel, 1 to 16");
    field("shadows", self.shadows, "shadows of the sun");
    field("ambient_occlusion", self.ambient_occlusion, "corners that see less sky are darker");
  }

  /// One sample per pixel and no ambient occlusion.
  static RenderOptions preview() { return {1, true, false}; }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const RenderOptions& options);

struct Rendering {
  cv::Mat radiance;  ///< CV_32FC3, RGB, linear; 1 is a white surface in full light; 0 outside the lens
  cv::Mat depth;     ///< CV_32FC1, exact at the pixel centres, as exact_depth() gives it
};

/// Sub-pixel positions, in pixels from the centre: pairs mirrored about it, every row and column of the grid
/// of `samples` x `samples` used once.
std::vector<Eigen::Vector2d> sample_pattern(int samples);

/// Holds the textures of a scene, which must outlive it.
class Renderer {
 public:
  explicit Renderer(const Scene& scene);
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// The same bits for any number of threads. A surface shades once per pixel, at the pixel's centre where it
  /// covers that; only its outline and its shadow are sampled.
  [[nodiscard]] Rendering render(const RayGrid& grid, const Pose& T_world_camera,
                                 const RenderOptions& options, int threads = 1) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pade::simulation
