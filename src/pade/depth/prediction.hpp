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

/// Derotated flow that the depth image of another frame foretells for a pair, as a start for matching: coarse
/// (every fourth pixel is looked at), with its holes filled from what is near them.
/// @param depth        CV_32FC1 of that frame, m; NaN = none
/// @param T_reference_frame  pose of that frame's camera in the reference
/// @param motion       of the pair. @return as predict_flow(), on the reference's pixels
cv::Mat foretell_flow(const cv::Mat& depth, const Camera& camera, const Pose& T_reference_frame,
                      const RelativeMotion& motion);

}  // namespace pade::depth
