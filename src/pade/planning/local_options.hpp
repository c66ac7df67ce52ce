// What the local planner may ask of the vehicle, and how it looks for its way.
#pragma once

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::planning {

/// The vehicle as the planner knows it.
struct VehicleLimits {
  double radius = 0.35;     ///< of the ball that holds it, m
  double speed = 2;         ///< m/s
  double acceleration = 3;  ///< of braking, m/s^2
  double pick_up = 2;     ///< of speeding up and turning, m/s^2: the less the vehicle tilts, the more it sees
  double latency = 0.35;  ///< from the moment of an image until what it shows changes the motion, s
  double overshoot = 0.05;    ///< it comes to rest so far beyond its planned standstill, m for each m/s
  double nose_angle = 0.262;  ///< the velocity is never farther from the nose than this, rad
  double lowest = 0.7;        ///< height of its centre in the world, m
  double highest = 2.8;       ///< and the greatest, m

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("radius", self.radius, "of the ball that holds the vehicle, m");
    field("speed", self.speed, "greatest speed, m/s");
    field("acceleration", self.acceleration, "of braking, m/s^2");
    field("pick_up", self.pick_up, "of speeding up and turning, m/s^2");
    field("latency", self.latency, "from an image until what it shows changes the motion, s");
    field("overshoot", self.overshoot,
          "it comes to rest so far beyond its planned standstill, m for each m/s of speed");
    field("nose_angle", self.nose_angle, "the velocity is never farther from the nose than this, rad");
    field("lowest", self.lowest, "least height of its centre in the world, m");
    field("highest", self.highest, "greatest height of its centre in the world, m");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const VehicleLimits& limits);

struct LocalPlannerOptions {
  VehicleLimits vehicle;
  double margin = 0.05;          ///< added to the radius, m
  double margin_sigmas = 1;      ///< and this many sigmas of the pose
  double horizon = 0.8;          ///< a primitive is flown this long before its stop, s
  double step = 0.1;             ///< between the points at which a path is looked at, s
  double reach = 8;              ///< how far ahead free space is looked for, m
  double slowest = 0.3;          ///< the governor never asks for less, m/s
  double arrival = 1;            ///< horizontally nearer to the goal is there, in height than this or 0.5, m
  bool unknown_is_free = false;  ///< fly into what nobody has seen
  bool peering = true;           ///< swing sideways where straight flight leaves the way ahead unknown

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("vehicle", self.vehicle, "what the vehicle may do");
    field("margin", self.margin, "added to the radius, m");
    field("margin_sigmas", self.margin_sigmas, "and this many sigmas of the pose");
    field("horizon", self.horizon, "a primitive is flown this long before its stop, s");
    field("step", self.step, "between the points at which a path is looked at, s");
    field("reach", self.reach, "how far ahead free space is looked for, m");
    field("slowest", self.slowest, "the governor never asks for less, m/s");
    field("arrival", self.arrival,
          "horizontally nearer to the goal is there, in height nearer than this or 0.5 m; m");
    field("unknown_is_free", self.unknown_is_free, "fly into what nobody has seen");
    field("peering", self.peering, "swing sideways where straight flight leaves the way ahead unknown");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const LocalPlannerOptions& options);

}  // namespace pade::planning
