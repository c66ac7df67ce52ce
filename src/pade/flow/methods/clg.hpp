// Combined local-global optical flow (Bruhn, Weickert and Schnoerr 2005), quadratic and robust.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct ClgOptions {
  FlowOptions pyramid;
  int warps = 1;
  int coarse_warps = 5;
  int lagged = 1;
  int sweeps = 8;
  double omega = 1.9;
  double alpha = 8;
  double gamma = 30;
  double normalisation = 0;
  double data_epsilon = 1;
  double smooth_epsilon = 0.02;
  double rho = 0.4;
  int radius = 1;
  int median = 5;
  int coarse_median = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("pyramid", self.pyramid, "options of all coarse-to-fine methods");
    field("warps", self.warps, "warps on the finest level");
    field("coarse_warps", self.coarse_warps, "warps on each coarser level");
    field("lagged", self.lagged, "updates of the robust weights per warp");
    field("sweeps", self.sweeps, "red-black sweeps per update of the weights");
    field("omega", self.omega, "over-relaxation factor");
    field("alpha", self.alpha, "weight of the smoothness term");
    field("gamma", self.gamma, "weight of gradient constancy against brightness constancy");
    field("normalisation", self.normalisation,
          "zeta of the constraint normalisation, grey values per pixel; 0 = none");
    field("data_epsilon", self.data_epsilon, "scale of the robust data term, grey values; 0 = quadratic");
    field("smooth_epsilon", self.smooth_epsilon,
          "scale of the robust smoothness term, pixels per pixel; 0 = quadratic");
    field("rho", self.rho, "standard deviation of the tensor's window, pixels");
    field("radius", self.radius, "radius of that window, pixels; 0 = none");
    field("median", self.median, "size of the median filter after each warp of the finest level: 0, 3 or 5");
    field("coarse_median", self.coarse_median, "and of each coarser level");
  }
};

ClgOptions clg_fast_options();
ClgOptions clg_half_options();
/// Half size and half the warps: flow that another one starts from.
ClgOptions clg_guide_options();
ClgOptions clg_accurate_options();
ClgOptions clg_linear_options();

std::unique_ptr<FlowEstimator> make_clg(const ClgOptions& options, std::string name);

}  // namespace pade::flow
