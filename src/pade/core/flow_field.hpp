// Optical flow between two images: what the flow room gives and the depth room takes.
#pragma once

#include <opencv2/core.hpp>

namespace pade {

/// Dense optical flow w on the pixel grid of the first of two images: first(p) = second(p + w(p)).
struct FlowField {
  cv::Mat vectors;  ///< CV_32FC2, pixels (x right, y down); NaN in either component = no flow
  /// Standard deviation of each component, pixels. CV_32FC1, or empty where the method gives none.
  /// Infinity or NaN = the image says nothing here.
  cv::Mat sigma;

  [[nodiscard]] bool empty() const { return vectors.empty(); }
};

}  // namespace pade
