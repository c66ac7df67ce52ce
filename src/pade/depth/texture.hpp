// Does the image say anything about motion along the epipolar line? The gate of the state "no texture".
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"

namespace pade::depth {

/// Structure tensor of an image on blocks of kTextureBlock x kTextureBlock pixels, each averaged with its
/// eight neighbours: what a flow method that looks at a neighbourhood of about a dozen pixels can see.
struct StructureTensor {
  cv::Mat xx, xy, yy;  ///< CV_32FC1, ceil(size / kTextureBlock), mean squared gradient, (grey levels / px)^2
};
inline constexpr int kTextureBlock = 4;

/// Structure tensor of a CV_8UC1 image of at least 3 x 3 pixels from 3 x 3 Sobel gradients.
StructureTensor structure_tensor(const cv::Mat& image);

/// Standard deviation of the image noise, grey levels: median absolute difference between the images where
/// the flow matches them, over the quarter of the pixels with the weakest gradient (their difference is
/// noise, not flow error). At least the noise of rounding to 8 bits. @return that minimum where nothing
/// matches.
double image_noise(const cv::Mat& first, const cv::Mat& second, const FlowField& flow);

/// Marks blocks whose gradient along the epipolar line (direction A t) is below `gate` times that of pure
/// noise.
/// @param noise  image_noise(). @param size  of the image.
/// @return CV_8UC1 of `size`: 0 or DepthState::no_texture.
cv::Mat texture_gate(const StructureTensor& tensor, const Camera& camera, const RelativeMotion& motion,
                     double gate, double noise, cv::Size size);

}  // namespace pade::depth
