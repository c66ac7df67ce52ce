// A flight through a world, written as a sequence folder (docs/design.md): images, exact depth, poses,
// camera.yaml and the sensors' files. A run that was cut short goes on where it stopped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/render/renderer.hpp"

namespace pade::simulation {

struct SequenceOptions {
  std::uint64_t seed = 1;  ///< of the noise of image and sensors
  RenderOptions render;
  int threads = 1;
  int every = 1;  ///< render only each n-th frame, to look at a flight quickly
  bool save_flow =
      false;  ///< flow_next/, flow_previous/ (.flo) and visible_next/, visible_previous/ (PNG, 255 = seen)
  io::Overwrite overwrite = io::Overwrite::refuse;
  bool keep_finished = false;  ///< if `target` holds this very sequence already, that is success
};

/// Called after each frame with the numbers of finished frames and of all frames.
using FrameProgress = std::function<void(int, int)>;

/// The camera of a flight: field by field its own, else the world's first, else the paper's 640 x 480 with
/// f = 554.26. With it T_body_camera, colour and noise where the flight leaves them to the world.
struct FlightCamera {
  Camera camera;
  Pose T_body_camera;
  ImageOptions image;
};
FlightCamera flight_camera(const Flight& flight, const World& world);

/// What to say of a flight that leads farther from the origin than farthest_exact_place (world/geometry.hpp);
/// empty where it does not.
std::optional<std::string> precision_warning(const Flight& flight);

/// Renders `flight` through `scene` into the folder `target`. Until it is complete everything lies in a
/// hidden folder beside it; each file appears there whole or not at all, so that the work of a killed run is
/// taken up by the next one and the result has the same bytes. Refuses an existing `target` (unless told to
/// replace it), waypoints that the limits forbid, a path too short for the frames, a camera inside a solid or
/// beyond farthest_place, and output that cannot be written.
Status write_sequence(const Scene& scene, const Flight& flight, const std::filesystem::path& target,
                      const SequenceOptions& options, const FrameProgress& progress = {});

/// Sequence folders are known by this file, which says how they were made.
inline constexpr std::string_view simulation_record = "simulation.json";

/// counts per metre of depth/<time>.png.
inline constexpr double simulated_depth_scale = 1000;

}  // namespace pade::simulation
