// Dense Lucas-Kanade, coarse to fine, re-linearised at each pixel's own flow.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct LucasKanadeOptions {
  FlowOptions pyramid;        ///< options of all coarse-to-fine methods
  int iterations = 3;         ///< iterations per level
  int coarse_iterations = 5;  ///< iterations on each coarser level
  int radius = 5;             ///< the window spans 2 radius + 1 pixels
  double sigma = 2.5;         ///< standard deviation of the Gaussian window, pixels
  double local_mean = 4;      ///< standard deviation of the local mean that is subtracted from the images, so
                              ///< that exposure may change, pixels; 0 = none
  double damping = 0.1;       ///< weight of the present flow in the normal equations, grey values squared
  double largest_step = 2;    ///< an iteration moves the flow by no more, pixels of its level
  int median = 5;             ///< size of the median filter after each level: 0, 3 or 5
  int coarse_median = 5;
};

/// What suits half resolution: an iteration costs a quarter there.
LucasKanadeOptions lucas_kanade_half_options();

/// Lucas-Kanade in the FOLKI form (Le Besnerais and Champagnat 2005; Plyer et al. 2016).
std::unique_ptr<FlowEstimator> make_lucas_kanade(const LucasKanadeOptions& options = {},
                                                 std::string name = "lucas-kanade");

}  // namespace pade::flow
