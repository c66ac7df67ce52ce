#include "pade/simulation/flight/frame_maker.hpp"

#include "pade/simulation/render/truth.hpp"

namespace pade::simulation {

FrameMaker::FrameMaker(const Scene& scene, const Camera& camera, const FrameOptions& options)
    : scene_(scene), options_(options), grid_(camera), renderer_(scene) {}

Rendering FrameMaker::expose(const Pose& T_world_camera, const PoseAt& pose_at) const {
  if (options_.exposure_time <= 0)
    return renderer_.render(grid_, T_world_camera, options_.render, options_.threads);
  Rendering blurred;
  blurred.depth = exact_depth(scene_, grid_, T_world_camera, options_.threads);
  for (int k = 0; k < options_.blur_samples; ++k) {
    const double offset = options_.exposure_time * ((k + 0.5) / options_.blur_samples - 0.5);
    const Rendering part = renderer_.render(grid_, pose_at(offset), options_.render, options_.threads);
    if (k == 0) {
      blurred.radiance = part.radiance;
    } else {
      blurred.radiance += part.radiance;
    }
  }
  blurred.radiance /= options_.blur_samples;
  return blurred;
}

cv::Mat FrameMaker::picture(const Rendering& light, Time time) const {
  return form_image(light.radiance, grid_, options_.image, time.seconds(), options_.seed,
                    static_cast<std::uint64_t>(time.nanoseconds), options_.threads);
}

}  // namespace pade::simulation
