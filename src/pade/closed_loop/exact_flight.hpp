// The local planner alone: a vehicle that flies exactly what it is told, on exact depth images, through the
// map. What is left to fail is the planner and the map.
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/planning/local_planner.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/render/surface_distance.hpp"

namespace pade::closed_loop {

enum class Outcome { arrived, collided, timed_out };

struct ExactFlightOptions {
  planning::LocalPlannerOptions planner;
  mapping::MapOptions map = exact_map();
  double frame_rate = 10;    ///< Hz; a plan takes effect one frame after its image
  double time_limit = 180;   ///< s
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

/// A moment of a flight, 100 a second.
struct FlightSample {
  planning::MotionState state;
  double clearance = 0;  ///< from the centre to the nearest true surface, at most 2 m
};
/// A plan of a flight, one a frame.
struct FlightPlan {
  double time = 0;  ///< of the image, s
  planning::PlanKind kind = planning::PlanKind::committed;
  double speed_limit = 0;
  double free_reach = 0;
  int valid = 0;
};

struct FlightRecord {
  Outcome outcome = Outcome::timed_out;
  double duration = 0;         ///< s
  double length = 0;           ///< flown, m
  double goal_velocity = 0;    ///< way made good toward the goal over the time, m/s
  double least_clearance = 0;  ///< of the centre from the nearest true surface, m
  int stops = 0;               ///< times that it stood still on the way
  std::vector<FlightSample> samples;
  std::vector<FlightPlan> plans;
};

/// A world and a task in it.
struct FlightTask {
  const simulation::Scene& scene;
  const simulation::SurfaceDistance& surface;
  Eigen::Vector3d start;  ///< m
  Eigen::Vector3d goal;   ///< m
};

/// Flies from start to goal, from a standstill with the nose toward the goal. It ends there, at the first
/// contact of the vehicle's ball with the true surface (looked at 100 times a second), or at the time limit.
/// The same bytes each time. Refuses options that make no sense.
Result<FlightRecord> fly_exact(const FlightTask& task, const ExactFlightOptions& options = {});

}  // namespace pade::closed_loop

template <>
struct pade::EnumNames<pade::closed_loop::Outcome> {
  using O = pade::closed_loop::Outcome;
  static constexpr std::array names = {std::pair{O::arrived, std::string_view("arrived")},
                                       std::pair{O::collided, std::string_view("collided")},
                                       std::pair{O::timed_out, std::string_view("timed out")}};
};
