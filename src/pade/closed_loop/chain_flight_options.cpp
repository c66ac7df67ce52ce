#include <array>

#include "pade/closed_loop/chain_flight.hpp"
#include "pade/core/option_check.hpp"

namespace pade::closed_loop {

ObstacleMapperOptions ChainFlightOptions::outdoors() {
  ObstacleMapperOptions options;
  options.footing.on = true;
  return options;
}

Status check(const ChainFlightOptions& options) {
  const std::array<OptionRange, 8> ranges = {{{"climb", options.climb, 0, 100},
                                              {"frame_rate", options.frame_rate, 1, 100},
                                              {"time_limit", options.time_limit, above_zero, 1e5},
                                              {"stand", options.stand, 0, ChainFlightOptions::longest_stand},
                                              {"known_start", options.known_start, 0, 100},
                                              {"blind_after", options.blind_after, above_zero, 100},
                                              {"exposure_time", options.exposure_time, 0, 1},
                                              {"width", static_cast<double>(options.width), 64, 4096}}};
  if (const Status s = check_ranges(ranges); !s) return s;
  if (const Status s = within("vehicle", check(options.vehicle)); !s) return s;
  if (const Status s = within("fault", check(options.fault)); !s) return s;
  if (const Status s = within("image", simulation::check(options.image)); !s) return s;
  if (const Status s = within("render", simulation::check(options.render)); !s) return s;
  if (const auto planner = planning::LocalPlanner::create(options.planner); !planner)
    return Error{"planner: " + planner.error().message};
  return {};
}

}  // namespace pade::closed_loop
