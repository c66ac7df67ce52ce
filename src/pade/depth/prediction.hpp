// From the flow of one pair of frames to the flow that another pair with the same reference should show:
// where matching over a longer baseline begins.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/pose.hpp"

namespace pade::depth {

/// Derotated flow of the pair `to` from that of the pair `from`: D_to = a_to rho / (1 + rho (t_z,from -
/// t_z,to)) with rho = a.D / (a.a + e^2), the inverse of Z - t_z of the first pair, drawn to zero where the
/// epipole leaves it without parallax (e = 5 px times the baseline). Both motions have the same reference.
/// @param flow       CV_32FC2, derotated by `from`'s rotation, px; NaN = none
/// @param from, to   motions of the two pairs
/// @return CV_32FC2 of that size, px: finite everywhere; zero where nothing is known or the point would be
/// behind the camera
cv::Mat predict_flow(const cv::Mat& flow, const Camera& camera, const RelativeMotion& from,
                     const RelativeMotion& to);

/// A guess where nothing is known: the mean of 1/Z over the known of the 31 x 31 pixels around.
/// @param depth  CV_32FC1, m; NaN = none. @return the same with its holes filled; NaN where all around is one
cv::Mat filled_depth(const cv::Mat& depth);

/// Derotated flow that a depth image of the reference foretells for a pair: D = a / (Z - t_z).
/// @param depth  CV_32FC1, m; NaN = none. @return as predict_flow().
cv::Mat flow_of_depth(const cv::Mat& depth, const Camera& camera, const RelativeMotion& motion);

/// The depth image of one frame as another one sees it: each pixel moved to where its point is seen, the
/// nearest where several fall together; holes of a pixel take the nearest of their neighbours.
/// @param depth  CV_32FC1 of `from`, m; NaN = none. @param T_to_from  pose of that camera in the other.
/// @return CV_32FC1, m; NaN where nothing is known
cv::Mat reproject_depth(const cv::Mat& depth, const Camera& camera, const Pose& T_to_from);

}  // namespace pade::depth
