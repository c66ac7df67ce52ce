// Farneback's method: flow from quadratic expansions of both images.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct FarnebackOptions {
  FlowOptions pyramid;           ///< options of all coarse-to-fine methods
  int iterations = 2;            ///< iterations on the finest level
  int coarse_iterations = 3;     ///< iterations on each coarser level
  int expansion_radius = 3;      ///< the quadratic is fitted to 2 radius + 1 pixels
  double expansion_sigma = 1.0;  ///< standard deviation of that fit's weights, pixels
  int radius = 4;                ///< the window spans 2 radius + 1 pixels
  double sigma = 2.5;            ///< standard deviation of the Gaussian window, pixels
  double damping = 0.01;         ///< weight of the present flow in the normal equations
  double largest_step = 2;       ///< an iteration moves the flow by no more, pixels of its level
  int median = 5;                ///< size of the median filter after the finest level: 0, 3 or 5
  int coarse_median = 5;         ///< size of the median filter after each coarser level: 0, 3 or 5
};

/// What suits half resolution: an iteration costs a quarter there.
FarnebackOptions farneback_half_options();

/// Two-frame motion from polynomial expansion (Farneback 2003).
std::unique_ptr<FlowEstimator> make_farneback(const FarnebackOptions& options = {},
                                              std::string name = "farneback");

}  // namespace pade::flow
