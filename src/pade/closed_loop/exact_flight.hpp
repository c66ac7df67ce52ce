// The local planner alone: a vehicle that flies exactly what it is told, on exact depth images, through the
// map. What is left to fail is the planner and the map.
#pragma once

#include "pade/closed_loop/flight_record.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/planning/local_planner.hpp"

namespace pade::closed_loop {

struct ExactFlightOptions {
  planning::LocalPlannerOptions planner;
  mapping::MapOptions map = exact_map();
  double frame_rate = 10;    ///< Hz; a plan takes effect one frame after its image
  double time_limit = 120;   ///< s
  double known_start = 1.5;  ///< m about the start that are known to be free
  int width = 320;           ///< of the image, with a horizontal field of view of 60 degrees

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("planner", self.planner, "local planner");
    field("map", self.map, "occupancy map");
    field("frame_rate", self.frame_rate, "Hz");
    field("time_limit", self.time_limit, "s");
    field("known_start", self.known_start, "m about the start that are known to be free");
    field("width", self.width, "of the image, px");
  }
  /// What suits depth without error: one look is enough, and far hits count at once.
  static mapping::MapOptions exact_map();
};

/// Flies from start to goal, from a standstill with the nose toward the goal. It ends there, at the first
/// contact of the vehicle's ball with the true surface (looked at 100 times a second), or at the time limit.
/// The same bytes each time. Refuses options that make no sense.
Result<FlightRecord> fly_exact(const FlightTask& task, const ExactFlightOptions& options = {});

}  // namespace pade::closed_loop
