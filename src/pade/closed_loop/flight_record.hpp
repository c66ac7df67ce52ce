// What a flight in a closed loop leaves: where it was, how near the true surface, what was planned, how it
// ended.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/camera.hpp"
#include "pade/core/options.hpp"
#include "pade/planning/local_planner.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/render/surface_distance.hpp"

namespace pade::closed_loop {

/// How a flight ended.
enum class Outcome {
  arrived,
  collided,
  timed_out,
  astray,       ///< it believed itself at the goal, more than 5 m from it
  never_ready,  ///< the navigation knew no pose to take off with
};

/// A moment of a flight, 100 a second.
struct FlightSample {
  planning::MotionState state;  ///< true; world ENU
  double clearance = 0;         ///< from the centre to the nearest true surface, at most 2 m
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
  double duration = 0;         ///< s, climb included
  double length = 0;           ///< flown on the way, m
  double goal_velocity = 0;    ///< way made good toward the goal over the time of the way, m/s
  double goal_distance = 0;    ///< horizontal, from the true goal at the end, m
  double goal_height = 0;      ///< above the true goal at the end, m
  double least_clearance = 0;  ///< of the centre from the nearest true surface, m
  int stops = 0;               ///< times that it stood still on the way
  bool stands = false;         ///< at the end
  std::vector<FlightSample> samples;
  std::vector<FlightPlan> plans;
};

/// A world and a task in it.
struct FlightTask {
  const simulation::Scene& scene;
  const simulation::SurfaceDistance& surface;
  Eigen::Vector3d start;   ///< m
  Eigen::Vector3d goal;    ///< m
  std::uint64_t seed = 1;  ///< of instruments and image noise
};

/// Farther from it than the space that is known about it and this, no plan looks at the place of take-off, m.
inline constexpr double kStartInSight = 10;
/// A pinhole with a horizontal field of view of 60 degrees, 4 : 3.
/// @param width  px
Camera forward_camera(int width);
/// Direction of the nose of a body, from east toward north, rad.
double yaw_of(const Eigen::Quaterniond& R_world_body);

/// Looks at the truth while a flight goes on.
class FlightWatch {
 public:
  /// @param radius  of the vehicle, m
  FlightWatch(const FlightTask& task, double radius) : task_(task), radius_(radius) {}

  /// One look, 100 a second. False if the vehicle touches something: the flight has ended.
  bool look(const planning::MotionState& truth);
  /// From the true goal to the last place that was looked at, m.
  [[nodiscard]] Eigen::Vector3d from_goal() const;
  /// The horizontal part of that.
  [[nodiscard]] double goal_distance() const { return from_goal().head<2>().norm(); }
  void add(const FlightPlan& plan) { record_.plans.push_back(plan); }
  /// Ends the flight. A collision that was seen stays one.
  /// @param from  s: when its way began. Clearance (unless it collides before), length, stops and velocity
  ///              count from here on.
  FlightRecord finished(Outcome outcome, double from = 0);

 private:
  void measure_way(double from);

  const FlightTask& task_;
  double radius_;
  bool collided_ = false;
  FlightRecord record_;
};

}  // namespace pade::closed_loop

template <>
struct pade::EnumNames<pade::closed_loop::Outcome> {
  using O = pade::closed_loop::Outcome;
  static constexpr std::array names = {std::pair{O::arrived, std::string_view("arrived")},
                                       std::pair{O::collided, std::string_view("collided")},
                                       std::pair{O::timed_out, std::string_view("timed out")},
                                       std::pair{O::astray, std::string_view("astray")},
                                       std::pair{O::never_ready, std::string_view("never ready")}};
};
