// Surface colour by texture coordinates, cut off at the size of the pixel that looks: an image pyramid
// sampled along the longer axis of the pixel's footprint (anisotropic trilinear filtering). Detail beyond
// that would flicker from frame to frame and pass for motion.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/simulation/world/pattern.hpp"

namespace pade::simulation {

/// A periodic image of linear reflectance.
class Texture {
 public:
  /// `pixels`: CV_32FC3, RGB, linear, 0 to 1; resampled to powers of two. `size`: of the tile, in texture
  /// coordinates.
  Texture(const cv::Mat& pixels, const Eigen::Vector2f& size);
  /// An sRGB picture (CV_8UC3, BGR) over the unit square.
  static Texture from_image(const cv::Mat& bgr);
  /// A procedural pattern at scale 1, coordinates in metres.
  static Texture from_pattern(PatternKind kind);
  /// Grey clouds of mean 0.5, for stains and skies; about 0.7 m to 11 m long.
  static Texture clouds();

  /// Mean over the parallelogram that `across` and `down` span about `at`: what one pixel sees. RGB.
  /// `most_taps`: reads along its longer side; with fewer a surface seen at a low angle is more blurred.
  [[nodiscard]] Eigen::Array3f sample(const Eigen::Vector2f& at, const Eigen::Vector2f& across,
                                      const Eigen::Vector2f& down, int most_taps = 8) const;
  [[nodiscard]] Eigen::Array3f mean() const;

 private:
  using Texel = Eigen::Array4f;  // RGB and a spare: one aligned load
  struct Level {
    int width = 1;
    int height = 1;
    int stride = 1;  ///< texels from row to row: not a power of two, or the rows would share cache sets
    std::vector<Texel> texels;
  };
  [[nodiscard]] static Eigen::Array4f bilinear(const Level& level, float x, float y);

  std::vector<Level> levels_;
  Eigen::Vector2f texels_per_unit_;
};

/// The pixels of a pattern's tile, CV_32FC3, RGB, linear; `size` metres on a side.
struct PatternTile {
  cv::Mat pixels;
  float size = 4;
};
PatternTile draw_pattern(PatternKind kind);
/// Periodic noise of mean 0 and about unit range, CV_32FC1: `octaves` octaves from `coarsest` cells per side
/// on, each `gain` of the one before.
cv::Mat draw_noise(int pixels, int coarsest_x, int coarsest_y, int octaves, float gain, std::uint32_t seed);

}  // namespace pade::simulation
