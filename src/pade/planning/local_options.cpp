#include "pade/planning/local_options.hpp"

#include <array>

#include "pade/core/option_check.hpp"

namespace pade::planning {

Status check(const VehicleLimits& limits) {
  const std::array<OptionRange, 7> ranges = {{{"radius", limits.radius, above_zero, 10},
                                              {"speed", limits.speed, above_zero, 50},
                                              {"acceleration", limits.acceleration, 0.1, 50},
                                              {"pick_up", limits.pick_up, 0.1, 50},
                                              {"latency", limits.latency, 0, 10},
                                              {"overshoot", limits.overshoot, 0, 1},
                                              {"nose_angle", limits.nose_angle, 0.01, 3.2}}};
  if (const Status s = check_ranges(ranges); !s) return s;
  const std::array<OptionRange, 2> heights = {
      {{"lowest", limits.lowest, -finite, finite}, {"highest", limits.highest, limits.lowest, finite}}};
  return check_ranges(heights);
}

Status check(const LocalPlannerOptions& options) {
  if (const Status s = within("vehicle", check(options.vehicle)); !s) return s;
  const std::array<OptionRange, 7> ranges = {{{"margin", options.margin, 0, 10},
                                              {"margin_sigmas", options.margin_sigmas, 0, 10},
                                              {"horizon", options.horizon, 0.1, 10},
                                              {"step", options.step, 0.01, 0.5},
                                              {"reach", options.reach, 0.5, 100},
                                              {"slowest", options.slowest, 0.05, options.vehicle.speed},
                                              {"arrival", options.arrival, 0.1, 100}}};
  return check_ranges(ranges);
}

}  // namespace pade::planning
