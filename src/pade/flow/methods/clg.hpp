// Combined local-global optical flow (Bruhn, Weickert and Schnoerr 2005), quadratic and robust.
#pragma once

#include <memory>
#include <string>

#include "pade/flow/flow_estimator.hpp"

namespace pade::flow {

struct ClgOptions {
  FlowOptions pyramid;           ///< options of all coarse-to-fine methods
  int warps = 1;                 ///< warps on the finest level
  int coarse_warps = 5;          ///< warps on each coarser level
  int lagged = 1;                ///< updates of the robust weights per warp
  int sweeps = 8;                ///< red-black sweeps per update of the weights
  double omega = 1.9;            ///< over-relaxation factor
  double alpha = 8;              ///< weight of the smoothness term
  double gamma = 30;             ///< weight of gradient constancy against brightness constancy
  double normalisation = 0;      ///< zeta of the constraint normalisation, grey values per pixel; 0 = none
  double data_epsilon = 1;       ///< scale of the robust data term, grey values; 0 = quadratic
  double smooth_epsilon = 0.02;  ///< scale of the robust smoothness term, pixels per pixel; 0 = quadratic
  double rho = 0.4;              ///< standard deviation of the tensor's window, pixels
  int radius = 1;                ///< radius of that window, pixels; 0 = none
  int median = 5;                ///< size of the median filter after each warp of the finest level: 0, 3 or 5
  int coarse_median = 5;         ///< and of each coarser level
};

ClgOptions clg_fast_options();
ClgOptions clg_half_options();
/// Half size and half the warps: flow that another one starts from.
ClgOptions clg_guide_options();
ClgOptions clg_accurate_options();
ClgOptions clg_linear_options();

std::unique_ptr<FlowEstimator> make_clg(const ClgOptions& options, std::string name);

}  // namespace pade::flow
