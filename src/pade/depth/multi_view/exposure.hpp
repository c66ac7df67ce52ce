// Views at the exposure of the frame that they are compared with.
#pragma once

#include <opencv2/core.hpp>

namespace pade::depth {

/// A view as it would be at the exposure of the reference: gain * grey + offset, robustly from some thousand
/// points, each where the view sees it. The exposures of cameras drift; several views are compared by their
/// grey values, and a fiftieth per frame is a third over the longest baseline.
/// @param reference, view  CV_8UC1, of one size. @param d  CV_32FC1, where the points of the reference are.
/// @param H, e  the point of pixel p~ at d is seen at H p~ + d e, homogeneous (flow::View)
/// @param valid  CV_8UC1, 0 = not seen; empty = all is
/// @return `view` itself where the exposures do not differ by a grey value, or the points do not tell.
cv::Mat at_exposure_of(const cv::Mat& reference, const cv::Mat& view, const cv::Mat& d, const cv::Matx33f& H,
                       const cv::Vec3f& e, const cv::Mat& valid = {});

}  // namespace pade::depth
