// Depth per pixel with its variance and, where there is none, the reason.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <opencv2/core.hpp>

#include "pade/core/time.hpp"

namespace pade {

/// What is known about a pixel. The states must not be merged: "low parallax" has texture and may be far, "no
/// texture" and "epipole" mean that nothing is known.
enum class DepthState : std::uint8_t {
  measured = 0,      ///< depth and variance are valid
  epipole = 1,       ///< too near the epipole: the baseline gives no parallax here at any depth of interest
  low_parallax = 2,  ///< textured, but the parallax is below the noise: far away, or the camera hardly moved
  no_texture = 3,    ///< the image says nothing about the motion of this pixel
  inconsistent = 4,  ///< the flow contradicts the epipolar geometry: moving object, occlusion or mismatch
  out_of_view = 5,   ///< masked, outside the lens, or its match lies outside the other image
  far = 6,           ///< textured and matched, and its `bound` lies beyond the range
};
/// Of the states, by their number: the legend in `run.json` and reports.
inline constexpr std::array<std::string_view, 7> depth_state_names = {
    "measured", "epipole", "low parallax", "no texture", "inconsistent", "out of view", "far"};

/// Z-depth on the pixel grid of the undistorted frame taken at `time`. With window n > 1 the images have
/// ceil(height / n) x ceil(width / n) cells, and a cell stands for its n x n pixels.
struct DepthImage {
  Time time;         ///< of the frame
  int window = 1;    ///< n
  cv::Mat depth;     ///< CV_32FC1, metres along the optical axis; NaN = no depth
  cv::Mat variance;  ///< CV_32FC1, m^2; NaN where there is no depth
  cv::Mat state;     ///< CV_8UC1 of DepthState; depth is NaN exactly where this is not `measured`
  /// CV_32FC1, m^2: the part of `variance` that is the pixel's own (flow). The rest is common to the image:
  /// baseline, rotation and direction of translation. NaN where there is no depth; empty = all is its own.
  cv::Mat own_variance{};
  /// CV_32FC1, m: nothing on the pixel's ray is nearer than this along the optical axis, whether or not it
  /// has a depth. NaN = nothing is known; empty = depth less some sigmas, where there is depth.
  cv::Mat bound{};

  /// True of an image without pixels: nothing was estimated.
  [[nodiscard]] bool empty() const { return depth.empty(); }
};

/// Pixel coordinate of the centre of cell `index` of windows of n pixels.
inline double cell_centre(int index, int n) { return index * n + 0.5 * (n - 1); }

/// The depth image with window 1: every cell repeated over its n x n pixels and cut to `size`.
DepthImage at_full_size(const DepthImage& image, cv::Size size);

}  // namespace pade
