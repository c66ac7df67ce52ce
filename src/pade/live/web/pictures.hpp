// Pictures of a frame for people: obstacles over the camera's image, depth with its uncertainty.
#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace pade::live {

/// Obstacles nearer than these are red and yellow, as on the displays of other vehicles, m.
inline constexpr double kRedDistance = 3, kYellowDistance = 6;
/// Depths with a sigma above this share of them place no obstacle in the map, and are shown as none.
inline constexpr float kShownRelativeSigma = 0.25F;

/// BGR: the image, with a red or yellow veil where it has a depth that is near and certain.
/// @param image     grey or BGR, 8 bit
/// @param depth     CV_32FC1, m, of the image's size or in cells; may be empty
/// @param variance  of it, m²
cv::Mat obstacle_picture(const cv::Mat& image, const cv::Mat& depth, const cv::Mat& variance);

/// BGR: warm is near, blue is 20 m and farther; the less certain a depth, the paler; dark grey: none.
/// @param size  of the picture
cv::Mat depth_picture(const cv::Mat& depth, const cv::Mat& variance, cv::Size size);

/// The same picture, at most 640 pixels wide.
cv::Mat small_picture(const cv::Mat& picture);

/// As a JPEG file.
std::string jpeg_of(const cv::Mat& picture);

}  // namespace pade::live
