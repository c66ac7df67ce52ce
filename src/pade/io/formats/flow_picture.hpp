// Optical flow as a picture: the Middlebury colour code, with its wheel and scale drawn beside it.
#pragma once

#include <opencv2/core.hpp>

namespace pade::io {

/// The Middlebury colour of each vector (Baker et al. 2011): hue is the direction, white is no motion, full
/// saturation is `full_scale` pixels, darker is more than that, black is unknown.
/// @param vectors  CV_32FC2, pixels, NaN = unknown. @param full_scale  pixels, > 0.
/// @return CV_8UC3 (BGR) of the same size.
cv::Mat flow_colors(const cv::Mat& vectors, double full_scale);

/// The length that 99 % of the known vectors stay below, rounded up to 1, 2 or 5 times a power of ten,
/// pixels: a full scale that reads well and does not follow single outliers. 1 where nothing is known.
double flow_full_scale(const cv::Mat& vectors);

/// flow_colors() with a panel on the right that shows the colour wheel and states its radius in pixels.
/// @param full_scale  pixels; 0 = flow_full_scale(vectors).
/// @return CV_8UC3 (BGR), wider than the flow by the panel, and at least as high as the wheel and its text.
cv::Mat flow_picture(const cv::Mat& vectors, double full_scale = 0);

}  // namespace pade::io
