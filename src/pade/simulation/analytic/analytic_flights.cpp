#include "pade/simulation/analytic/analytic_flights.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
constexpr double kFramePeriod = 0.1;  // s

/// Camera pose of a body at `position` with aircraft angles (rad): yaw from east counter-clockwise, pitch
/// nose down positive (FLU), roll right wing down positive.
Pose level_camera(const Vector3d& position, double yaw = 0, double pitch = 0, double roll = 0) {
  const Eigen::Quaterniond R_world_body = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                                          Eigen::AngleAxisd(roll, Vector3d::UnitX());
  return {(R_world_body * Eigen::Quaterniond(forward_camera_rotation())).normalized(), position};
}

/// An upright box from its lower corner to its upper corner, turned about its vertical axis.
AnalyticBox upright_box(const Vector3d& low, const Vector3d& high, double yaw = 0) {
  return {{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), 0.5 * (low + high)},
          0.5 * (high - low)};
}

AnalyticMaterial plain(double albedo, std::uint32_t seed, double contrast = 0.3, double coarsest = 1.2) {
  AnalyticMaterial material;
  material.albedo = albedo;
  material.seed = seed;
  material.contrast = contrast;
  material.coarsest = coarsest;
  return material;
}

/// A facade with boxes and balls before it, a blank wall on the right, and sky above.
AnalyticScene street() {
  AnalyticScene scene;
  scene.add("ground", HalfSpace{Vector3d::Zero(), Vector3d::UnitZ()}, plain(0.45, 11, 0.35));
  scene.add("facade", upright_box({16, -9, -0.5}, {18, 9, 5}), plain(0.6, 12));
  scene.add("blank wall", upright_box({6, -5.5, -0.5}, {13, -5, 3.2}), plain(0.65, 13, 0));
  scene.add("crate", upright_box({7, 1.2, 0}, {8.2, 2.4, 1.2}, 0.4), plain(0.5, 14, 0.35, 0.6));
  scene.add("tower", upright_box({10.5, -2.2, 0}, {11.7, -1.2, 3.0}, -0.3), plain(0.55, 15, 0.35, 0.6));
  scene.add(
      "tilted slab",
      AnalyticBox{{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector3d(1, 2, 3).normalized())), {9, 4, 1.5}},
                  {0.8, 0.5, 0.3}},
      plain(0.6, 16, 0.35, 0.6));
  scene.add("near ball", Sphere{{5.5, -0.9, 0.8}, 0.45}, plain(0.55, 17, 0.35, 0.4));
  scene.add("far ball", Sphere{{12, 1.5, 2.3}, 0.9}, plain(0.5, 18, 0.35, 0.6));
  return scene;
}

void add_building(AnalyticScene& scene) {
  AnalyticMaterial wall = plain(0.62, 21, 0.24, 1.6);
  wall.pane_period_u = 3.0;
  wall.pane_period_v = 2.9;
  wall.pane_width = 1.3;
  wall.pane_height = 1.5;
  scene.add("building", upright_box({22, -14, -1}, {28, 14, 6.0}), wall);
  scene.add("cornice", upright_box({21.6, -14.4, 6.0}, {28.4, 14.4, 6.4}), plain(0.7, 22, 0.2, 0.8));
  // A portico: four pillars under an architrave, in front of the wall.
  scene.add("architrave", upright_box({18.6, -4.6, 3.6}, {22.0, 4.6, 4.3}), plain(0.72, 23, 0.22, 0.8));
  for (int i = 0; i < 4; ++i) {
    const double y = -4.2 + 2.8 * i;
    const auto seed = static_cast<std::uint32_t>(30 + i);
    scene.add("pillar", upright_box({18.8, y - 0.28, 0.15}, {19.36, y + 0.28, 3.6}),
              plain(0.66, seed, 0.26, 0.5));
  }
  scene.add("steps", upright_box({18.0, -5.2, -0.5}, {22, 5.2, 0.15}), plain(0.58, 40, 0.24, 0.8));
  // One wing is freshly rendered: nothing on it tells a camera how it moves.
  scene.add("blank wing", upright_box({13, 8.2, -0.5}, {22, 12, 4.6}), plain(0.68, 41, 0));
}

/// A courtyard before a building with a portico; balls, crates, planters and a garden wall stand in it.
AnalyticScene courtyard() {
  AnalyticScene scene;
  scene.add("ground", HalfSpace{Vector3d::Zero(), Vector3d::UnitZ()}, plain(0.42, 20, 0.32, 1.0));
  add_building(scene);
  scene.add("garden wall", upright_box({2, -8.2, -0.5}, {22, -7.7, 1.9}), plain(0.5, 42, 0.34, 0.8));
  scene.add("crate", upright_box({8.0, 2.3, 0}, {9.1, 3.4, 1.1}, 0.5), plain(0.46, 43, 0.36, 0.4));
  scene.add("crate", upright_box({8.1, 2.5, 1.1}, {8.9, 3.3, 1.9}, 0.15), plain(0.52, 44, 0.36, 0.4));
  scene.add("planter", upright_box({11.5, -4.6, 0}, {13.3, -3.0, 0.9}, -0.25), plain(0.56, 45, 0.3, 0.5));
  scene.add("bush", Sphere{{12.4, -3.8, 1.45}, 0.85}, plain(0.36, 46, 0.5, 0.3));
  scene.add("stone ball", Sphere{{6.6, -1.7, 0.55}, 0.55}, plain(0.6, 47, 0.3, 0.4));
  scene.add("stone ball", Sphere{{15.2, 4.4, 0.8}, 0.8}, plain(0.6, 48, 0.3, 0.5));
  scene.add("lantern post", upright_box({10.2, 0.62, 0}, {10.42, 0.84, 2.6}), plain(0.4, 49, 0.4, 0.25));
  scene.add("lantern", Sphere{{10.31, 0.73, 2.85}, 0.3}, plain(0.75, 50, 0.25, 0.25));
  scene.add("obelisk",
            AnalyticBox{{Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d::UnitZ())), {14.5, -0.9, 1.4}},
                        {0.35, 0.35, 1.4}},
            plain(0.58, 51, 0.3, 0.4));
  return scene;
}

/// A quadrotor that accelerates, weaves round what stands in the courtyard and leans into its own
/// acceleration.
Pose courtyard_pose(double seconds) {
  const auto position = [](double t) {
    // Speed rises smoothly to 2.2 m/s with a time constant of one second.
    const double along = 2.2 * (t - 1.0 + std::exp(-t));
    return Vector3d(along, 0.75 * std::sin(0.9 * t) - 0.4 * t * t / (t + 2.5),
                    1.5 + 0.22 * std::sin(1.3 * t + 0.4));
  };
  constexpr double h = 1e-3;
  const Vector3d acceleration =
      (position(seconds + h) - 2 * position(seconds) + position(seconds - h)) / (h * h);
  constexpr double kGravity = 9.81;
  const double yaw = 0.10 * std::sin(0.8 * seconds + 0.5);
  const double pitch = 0.5 * acceleration.x() / kGravity + 0.02 * std::sin(1.7 * seconds);
  const double roll = -acceleration.y() / kGravity;
  return level_camera(position(seconds), yaw, pitch, roll);
}

Pose flight_pose(std::string_view name, int frame) {
  const Vector3d start(0, 0, 1.5);
  if (name == "forward") return level_camera(start + 0.2 * frame * Vector3d::UnitX());
  if (name == "sideways") return level_camera(start + 0.2 * frame * Vector3d::UnitY());
  if (name == "upward") return level_camera(start + 0.1 * frame * Vector3d::UnitZ());
  const double turn = frame * std::numbers::pi / 180;
  if (name == "turning") return level_camera(start + 0.2 * frame * Vector3d::UnitX(), turn - 0.1);
  if (name == "hover") return level_camera(start, turn - 0.1, 0.3 * turn, -0.2 * turn);
  return courtyard_pose(frame * kFramePeriod);
}

}  // namespace

Camera analytic_camera(int width, int height) {
  const double focal = 554.26 * width / 640.0;
  return {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), Distortion::none, {}};
}

const std::vector<std::string>& analytic_flight_names() {
  static const std::vector<std::string> names = {"forward", "sideways", "upward",
                                                 "turning", "hover",    "courtyard"};
  return names;
}

Result<AnalyticFlight> make_analytic_flight(std::string_view name, int frames, const Camera& camera) {
  std::string known;
  bool found = false;
  for (const std::string& candidate : analytic_flight_names()) {
    found = found || candidate == name;
    known += (known.empty() ? "" : ", ") + candidate;
  }
  if (!found) return Error{"unknown flight '" + std::string(name) + "'; expected one of " + known};

  AnalyticFlight flight;
  flight.name = name;
  flight.scene = name == "courtyard" ? courtyard() : street();
  flight.camera = camera;
  for (int k = 0; k < frames; ++k) {
    flight.times.push_back(Time::from_seconds(k * kFramePeriod));
    flight.T_world_camera.push_back(flight_pose(name, k));
  }
  return flight;
}

}  // namespace pade::simulation
