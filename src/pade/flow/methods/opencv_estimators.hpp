// OpenCV's dense flow methods behind our interface, to compare ours with.
#pragma once

#include <memory>
#include <string_view>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

/// Farneback's method with OpenCV's customary parameters (0.5, 5 levels, window 13, 10 iterations, 5, 1.1).
std::unique_ptr<FlowEstimator> make_opencv_farneback();

/// Dense inverse search (Kroeger et al. 2016) with one of OpenCV's presets.
enum class DisPreset { ultrafast, fast, medium };
std::unique_ptr<FlowEstimator> make_opencv_dis(DisPreset preset);

/// Pyramidal Lucas-Kanade tracked at every pixel (window 21, 3 levels). NaN where tracking failed.
std::unique_ptr<FlowEstimator> make_opencv_pyrlk();

}  // namespace pade::flow
