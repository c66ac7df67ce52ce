// What the numbers of the depth room's options may be.
#include <numbers>

#include "pade/core/option_check.hpp"
#include "pade/depth/depth_options.hpp"
#include "pade/depth/edges.hpp"
#include "pade/depth/motion/motion_refinement.hpp"

namespace pade::depth {

Status check(const DepthOptions& o) {
  const OptionRange ranges[] = {
      {"window", static_cast<double>(o.window), 1, 65536},
      {"range", o.range, above_zero, finite},
      {"flow_sigma", o.flow_sigma, 0, finite},
      {"flow_sigma_scale", o.flow_sigma_scale, 0, finite},
      {"flow_relative_sigma", o.flow_relative_sigma, 0, finite},
      {"nearest", o.nearest, above_zero, finite},
      {"far", o.far, above_zero},
      {"parallax_gate", o.parallax_gate, 0, finite},
      {"residual_gate", o.residual_gate, 0},
      {"residual_angle", o.residual_angle, 0, std::numbers::pi / 2},
      {"texture_gate", o.texture_gate, 0, finite},
      {"texture_correlation", o.texture_correlation, -1},
      {"bound_sigmas", o.bound_sigmas, 0, finite},
  };
  return check_ranges(ranges);
}

Status check(const EdgeOptions& o) {
  const OptionRange ranges[] = {
      {"radius", static_cast<double>(o.radius), 0, 64},
      {"nearness", o.nearness, 0, 1},
  };
  return check_ranges(ranges);
}

Status check(const MotionRefinementOptions& o) {
  const OptionRange ranges[] = {
      {"pixels", static_cast<double>(o.pixels), 1, 1e6},
      {"least_sigma", o.least_sigma, above_zero, finite},
      {"inflation", o.inflation, above_zero, finite},
      {"rotation_floor_deg", o.rotation_floor_deg, 0, 180},
      {"direction_floor_deg", o.direction_floor_deg, 0, 180},
  };
  return check_ranges(ranges);
}

}  // namespace pade::depth
