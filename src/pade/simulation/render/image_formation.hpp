// From light to grey levels: exposure, vignetting, photon and read noise, display curve (EMVA 1288's camera
// model with an sRGB response).
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"
#include "pade/simulation/render/ray_grid.hpp"

namespace pade::simulation {

struct ImageOptions {
  bool colour = false;            ///< BGR, else grey
  double exposure = 1;            ///< gain on the radiance
  double exposure_change = 0.03;  ///< amplitude of a slow change of the exposure, relative
  double exposure_period = 6;     ///< of that change, s
  double vignetting = 0.25;       ///< light lost in the corners, relative
  double full_well =
      12000;  ///< electrons of a pixel at full scale: photon noise is its square root; 0 = none
  double read_noise = 0.004;  ///< standard deviation in the finished image, fraction of full scale

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("colour", self.colour, "colour images, else grey");
    field("exposure", self.exposure, "gain on the radiance");
    field("exposure_change", self.exposure_change, "amplitude of a slow change of the exposure, relative");
    field("exposure_period", self.exposure_period, "of that change, s");
    field("vignetting", self.vignetting, "light lost in the corners, relative");
    field("full_well", self.full_well, "electrons of a pixel at full scale, for the photon noise; 0 = none");
    field("read_noise", self.read_noise, "standard deviation in the image, fraction of full scale");
  }

  /// No noise, no vignetting, constant exposure.
  static ImageOptions ideal() { return {false, 1, 0, 6, 0, 0, 0}; }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const ImageOptions& options);

/// CV_8UC1 or CV_8UC3 (BGR) from linear RGB radiance. `time` (s) sets the exposure; the noise of a pixel
/// depends on `seed`, `frame` and the pixel alone, so that any number of threads gives the same image.
cv::Mat form_image(const cv::Mat& radiance, const RayGrid& grid, const ImageOptions& options, double time,
                   std::uint64_t seed, std::uint64_t frame, int threads = 1);

}  // namespace pade::simulation
