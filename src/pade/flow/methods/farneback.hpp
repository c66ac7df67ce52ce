// Farneback's method: flow from quadratic expansions of both images.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct FarnebackOptions {
  FlowOptions pyramid;
  int iterations = 2;
  int coarse_iterations = 3;
  int expansion_radius = 3;
  double expansion_sigma = 1.0;
  int radius = 4;
  double sigma = 2.5;
  double damping = 0.01;
  double largest_step = 2;
  int median = 5;
  int coarse_median = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("pyramid", self.pyramid, "options of all coarse-to-fine methods");
    field("iterations", self.iterations, "iterations on the finest level");
    field("coarse_iterations", self.coarse_iterations, "iterations on each coarser level");
    field("expansion_radius", self.expansion_radius, "the quadratic is fitted to 2 radius + 1 pixels");
    field("expansion_sigma", self.expansion_sigma, "standard deviation of that fit's weights, pixels");
    field("radius", self.radius, "the window spans 2 radius + 1 pixels");
    field("sigma", self.sigma, "standard deviation of the Gaussian window, pixels");
    field("damping", self.damping, "weight of the present flow in the normal equations");
    field("largest_step", self.largest_step, "an iteration moves the flow by no more, pixels of its level");
    field("median", self.median, "size of the median filter after the finest level: 0, 3 or 5");
    field("coarse_median", self.coarse_median,
          "size of the median filter after each coarser level: 0, 3 or 5");
  }
};

/// What suits half resolution, where an iteration costs a quarter.
FarnebackOptions farneback_half_options();

/// Two-frame motion from polynomial expansion (Farneback 2003).
std::unique_ptr<FlowEstimator> make_farneback(const FarnebackOptions& options = {},
                                              std::string name = "farneback");

}  // namespace pade::flow
