// How hard a world is to fly through.
#pragma once

#include <optional>

#include "pade/closed_loop/flight_record.hpp"

namespace pade::closed_loop {

/// Of the space 5 m to both sides of the straight way from start to goal, at the height of the start.
struct WorldMeasures {
  /// Mean free path of the vehicle in level directions from places where it fits, over its radius (the
  /// traversability of AvoidBench; free paths end at 20 m).
  double traversability = 0;
  /// Mean width of the gaps between neighbouring obstacles on lines across the way, over the vehicle's
  /// diameter; empty if no line, 10 m to both sides, meets two.
  std::optional<double> relative_gap;
};

/// The same for each call: places and directions are a fixed sequence.
/// @param radius  of the vehicle, m
WorldMeasures measures_of_world(const FlightTask& task, double radius);

/// How far about the climb to the start nothing stands, but for the ground and what is lower than 0.2 m; at
/// most `most`, m. Never more than is true: it is looked at from points that lie so close that nothing is
/// between them.
/// @param climb  m that the vehicle climbs to the start
double free_about(const FlightTask& task, double climb, double most);

}  // namespace pade::closed_loop
