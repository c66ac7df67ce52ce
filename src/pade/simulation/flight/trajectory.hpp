// The exact motion of a simulated quadrotor: a minimum-snap path through waypoints (Mellinger & Kumar, ICRA
// 2011) and the attitude that its thrust asks for. Everything that a sensor sees follows from here in closed
// form.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/flight/sensors/kinematics.hpp"

namespace pade::simulation {

/// A place to fly through.
struct Waypoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world ENU, metres
  double yaw = 0;              ///< heading of body x from east toward north, rad; not used with Heading::path
  std::optional<double> time;  ///< seconds from the start of the path; without it the speed decides
};

/// Where the nose points.
enum class Heading {
  waypoint,  ///< through the waypoints' yaw angles, as smoothly as the position
  path,      ///< along the horizontal velocity
};

/// What happens at an end of the path.
enum class PathEnd {
  moving,  ///< the vehicle flies through: velocity, acceleration and jerk are free
  rest,    ///< velocity, acceleration and jerk are zero
};

/// A rotation back and forth on top of the attitude that the thrust asks for: amplitude · sin(2π t / period +
/// phase).
struct Oscillation {
  double amplitude = 0;  ///< rad
  double period = 4;     ///< s
  double phase = 0;      ///< rad
};

/// What the vehicle may do. A trajectory that asks for more is refused.
struct FlightLimits {
  double speed = 15;        ///< m/s
  double acceleration = 8;  ///< m/s^2, without gravity
  double tilt = 0.6;        ///< rad, body z from the vertical
  double angular_rate = 4;  ///< rad/s
};

struct TrajectoryOptions {
  double speed = 2;  ///< mean speed between waypoints without a time, m/s
  Heading heading = Heading::waypoint;
  PathEnd start = PathEnd::moving;
  PathEnd end = PathEnd::moving;
  double gravity = 9.80665;  ///< m/s^2, along -z of the ENU world
  double drag = 0;           ///< linear drag per mass, 1/s: at speed v the vehicle leans into drag * v
  Oscillation roll, pitch, yaw;
  FlightLimits limits;
};

/// A path of degree-7 polynomials that minimises the integral of squared snap; position is continuous up to
/// the sixth derivative, attitude up to the fourth. Valid in [0, duration()]; times outside are clamped.
class Trajectory {
 public:
  /// Refuses fewer than two waypoints, non-finite numbers, times that do not grow, waypoints that coincide
  /// without a time between them, and flights beyond `options.limits` (the message says where and by how
  /// much).
  static Result<Trajectory> through(const std::vector<Waypoint>& waypoints,
                                    const TrajectoryOptions& options = {});

  [[nodiscard]] double duration() const { return times_.back(); }
  /// Times at which the waypoints are passed, s.
  [[nodiscard]] const std::vector<double>& waypoint_times() const { return times_; }
  /// The state of the body, exact to rounding; `time` (in the state: rounded to nanoseconds) counts from the
  /// start.
  [[nodiscard]] KinematicState at(double time) const;
  /// Derivative `order` (0 to 7) of (x, y, z, yaw of the waypoints) with respect to time.
  [[nodiscard]] Eigen::Vector4d derivative(double time, int order) const;

 private:
  using Coefficients = Eigen::Matrix<double, 8, 4>;  ///< rows: powers of local time / segment duration

  void solve(const std::vector<Eigen::Vector4d>& points);
  [[nodiscard]] double segment_length(std::size_t segment) const;
  [[nodiscard]] Status check_limits() const;

  TrajectoryOptions options_;
  std::vector<double> times_;
  std::vector<Coefficients> segments_;
};

}  // namespace pade::simulation

template <>
struct pade::EnumNames<pade::simulation::Heading> {
  static constexpr std::array names = {
      std::pair{pade::simulation::Heading::waypoint, std::string_view("waypoint")},
      std::pair{pade::simulation::Heading::path, std::string_view("path")}};
};
template <>
struct pade::EnumNames<pade::simulation::PathEnd> {
  static constexpr std::array names = {
      std::pair{pade::simulation::PathEnd::moving, std::string_view("moving")},
      std::pair{pade::simulation::PathEnd::rest, std::string_view("rest")}};
};
