// Named flights through analytic scenes: what the tests fly and what `pade sample` writes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/simulation/analytic/analytic_scene.hpp"

namespace pade::simulation {

/// A scene and the camera poses of a flight through it, 10 frames per second.
struct AnalyticFlight {
  std::string name;
  AnalyticScene scene;
  Camera camera;
  std::vector<Time> times;
  std::vector<Pose> T_world_camera;
};

/// The pinhole camera of the paper's simulation at any size: the horizontal field of view of 60 degrees that
/// 640 x 480 has with f = 554.26 px, principal point in the centre.
Camera analytic_camera(int width = 640, int height = 480);

/// The names that make_analytic_flight() knows:
/// - "forward":  0.2 m per frame straight toward a facade 16 m away, past boxes and balls
/// - "sideways": 0.2 m per frame to the left in the same scene
/// - "upward":   0.1 m per frame up in the same scene
/// - "turning":  0.2 m per frame forward with 1 degree of yaw per frame
/// - "hover":    pure rotation, no translation
/// - "courtyard": a quadrotor's flight through a courtyard toward a building: the sample flight
const std::vector<std::string>& analytic_flight_names();

/// A flight by its name. The error lists the names that exist.
Result<AnalyticFlight> make_analytic_flight(std::string_view name, int frames,
                                            const Camera& camera = analytic_camera());

}  // namespace pade::simulation
