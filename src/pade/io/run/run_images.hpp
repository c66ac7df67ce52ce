// The image stacks of a run as PNG files: 16-bit depth, sigma and bound, 8-bit states (flow: flow_file.hpp).
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"

namespace pade::io {

/// A PNG file in memory.
using PngBytes = std::vector<unsigned char>;

/// CV_32FC1 metres as 16-bit counts: 0 = none (NaN and values <= 0), 1..65535 = round(scale * metres),
/// saturated.
PngBytes encode_metres(const cv::Mat& metres, double scale);
/// The same for lower bounds, rounded down so that they stay bounds: 0 = none, also where less than a count.
PngBytes encode_bounds(const cv::Mat& metres, double scale);
/// The inverse of both: CV_32FC1, NaN where the file has 0.
cv::Mat metres_of(const cv::Mat& counts, double scale);

/// CV_8UC1 or CV_8UC3 as it is.
PngBytes encode_image(const cv::Mat& image);

}  // namespace pade::io
