// One fixed mapping of raw image values to 8 bit for a whole sequence. A mapping per frame would change the
// brightness of the same surface from frame to frame, which optical flow takes for motion.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// Raw value v becomes round(255 (v - low) / (high - low)), clamped to 1..255; raw 0 stays 0, because there
/// it means "no pixel" (a border, a mask). 8-bit images pass unchanged.
struct IntensityScaling {
  int bits = 8;  ///< of the raw images
  double low = 0;
  double high = 255;
  std::string source = "8-bit images";  ///< how it was found, for run.json

  /// `image`: 8 or 16 bit, any channels; the result is 8 bit with as many.
  [[nodiscard]] cv::Mat operator()(const cv::Mat& image) const;
};

/// From the 0.1 and 99.9 percentile of all values but 0 in `samples` (16 bit), widened by a tenth on both
/// sides for what the samples did not see.
IntensityScaling intensity_from_percentiles(const std::vector<cv::Mat>& samples);

}  // namespace pade::io
