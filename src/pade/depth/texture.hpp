// Does the image say anything about motion along the epipolar line? The gate of the state "no texture".
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"

namespace pade::depth {

/// Everything here is summed over blocks of this many pixels squared, and each block is judged together with
/// its eight neighbours: what a flow method that looks at a neighbourhood of about a dozen pixels can see.
inline constexpr int kTextureBlock = 4;

/// Standard deviation of the image noise, grey levels: median absolute difference between the images where
/// the flow matches them, over the quarter of the pixels with the weakest gradient (their difference is
/// noise, not flow error). At least 0.5, a little above the noise of rounding to 8 bits. @return that minimum
/// where nothing matches.
double image_noise(const cv::Mat& first, const cv::Mat& second, const FlowField& flow);

/// How blank an image must be to be no texture.
struct TextureLimits {
  double strong = 3;  ///< gradient along the epipolar line, in units of that of white noise: surely texture
  double correlation =
      0;  ///< weaker gradients are texture where both images show the same ones: at least this
};

/// Marks blocks that say nothing about motion along the epipolar line (direction A t): their gradient along
/// it is not clearly above that of noise, and the gradients of the two matched images are not correlated
/// either. Correlation is that of the deviations from the window's mean, so that shading, which looks the
/// same everywhere, does not count.
/// Around the epipole, and where the motion's covariance leaves its place open, flow in any direction may be
/// parallax: a block there is judged by its weakest gradient (smaller eigenvalue of the structure tensor).
/// @param reference, other  CV_8UC1, one size, at least 3 x 3. @param flow  from reference to other.
/// @param noise  image_noise(). @return CV_8UC1 of that size: 0 or DepthState::no_texture.
cv::Mat texture_gate(const cv::Mat& reference, const cv::Mat& other, const FlowField& flow,
                     const Camera& camera, const RelativeMotion& motion, const TextureLimits& limits,
                     double noise);

}  // namespace pade::depth
