// Optical flow between two images: what the flow room gives and the depth room takes.
#pragma once

#include <opencv2/core.hpp>

namespace pade {

/// Dense optical flow w on the pixel grid of the first of two images: first(p) = second(p + w(p)).
struct FlowField {
  cv::Mat vectors;  ///< CV_32FC2, pixels (x right, y down); NaN in either component = no flow
  /// Standard deviation of each component, pixels. CV_32FC1, or empty if the method gives none.
  /// Infinity or NaN = the image says nothing here.
  cv::Mat sigma;

  /// True of a field without pixels: nothing was estimated.
  [[nodiscard]] bool empty() const { return vectors.empty(); }
};

/// How far the pixels of a reference image have moved in several other views, with one unknown per pixel that
/// all views share: the distance d from the point at infinity, inverse depth times a constant. All CV_32FC1.
struct ParallaxField {
  cv::Mat distance;     ///< d, dense
  cv::Mat information;  ///< sum over the matching views of 1 / sigma^2 of d; 0 = no view says anything
  cv::Mat spread;  ///< chi-square, of matching - 1, of the further steps that these views ask for about their
                   ///< mean
  cv::Mat offset;  ///< d of the texture that this was read from, around a pixel, beyond the pixel's own
  cv::Mat matching;  ///< number of views whose match is right, as far as the images tell
  cv::Mat texture;   ///< squared slopes of the image along the parallax, in those of the noise around; noise
                     ///< alone: about 1, and 0 where no pixel around has more than noise may have

  /// True of a field without pixels: nothing was estimated.
  [[nodiscard]] bool empty() const { return distance.empty(); }
};

}  // namespace pade
