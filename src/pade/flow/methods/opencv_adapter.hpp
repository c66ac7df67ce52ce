// Our methods as cv::DenseOpticalFlow: a program written for OpenCV changes one line.
//
//   cv::Ptr<cv::DenseOpticalFlow> flow = pade::flow::create_dense_optical_flow("clg-fast");
//   flow->calc(previous_grey, next_grey, vectors);
#pragma once

#include <string_view>

#include <opencv2/video/tracking.hpp>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

/// Any method of make_flow_estimator() behind OpenCV's interface. `calc` takes CV_8UC1 (or CV_16UC1) images;
/// a `flow` of their size and type CV_32FC2 is the initial guess, as for OpenCV's DIS. Images that do not fit
/// raise cv::Exception, as in OpenCV. Empty if the name is unknown.
cv::Ptr<cv::DenseOpticalFlow> create_dense_optical_flow(std::string_view name,
                                                        const FlowOptions& options = {});

}  // namespace pade::flow
