// Dense Lucas-Kanade, coarse to fine, re-linearised at each pixel's own flow.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct LucasKanadeOptions {
  FlowOptions pyramid;
  int iterations = 3;
  int coarse_iterations = 5;
  int radius = 5;
  double sigma = 2.5;
  double local_mean = 4;
  double damping = 0.1;
  double largest_step = 2;
  int median = 5;
  int coarse_median = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("pyramid", self.pyramid, "options of all coarse-to-fine methods");
    field("iterations", self.iterations, "iterations per level");
    field("coarse_iterations", self.coarse_iterations, "iterations on each coarser level");
    field("coarse_median", self.coarse_median, "");
    field("radius", self.radius, "the window spans 2 radius + 1 pixels");
    field("sigma", self.sigma, "standard deviation of the Gaussian window, pixels");
    field("local_mean", self.local_mean,
          "standard deviation of the local mean that is subtracted from the images, so that exposure may "
          "change, "
          "pixels; 0 = none");
    field("damping", self.damping, "weight of the present flow in the normal equations, grey values squared");
    field("largest_step", self.largest_step, "an iteration moves the flow by no more, pixels of its level");
    field("median", self.median, "size of the median filter after each level: 0, 3 or 5");
  }
};

/// What suits half resolution, where an iteration costs a quarter.
LucasKanadeOptions lucas_kanade_half_options();

/// Lucas-Kanade in the FOLKI form (Le Besnerais and Champagnat 2005; Plyer et al. 2016).
std::unique_ptr<FlowEstimator> make_lucas_kanade(const LucasKanadeOptions& options = {},
                                                 std::string name = "lucas-kanade");

}  // namespace pade::flow
