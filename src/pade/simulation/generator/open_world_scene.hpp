// A world without lanes, ready to fly in: written, read, and known to have a way through.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "pade/core/result.hpp"
#include "pade/simulation/generator/open_world.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/render/surface_distance.hpp"

namespace pade::simulation {

/// Where a way is looked for: a box about start and goal, and the ball that has to get through.
struct PassageOptions {
  double radius = 0.5;     ///< of the ball, m
  double lowest = 0.7;     ///< its centre's least height, m
  double highest = 2.8;    ///< and the greatest, m
  double half_width = 22;  ///< to each side of start and goal, across the axis that the way rather follows, m
  double beyond = 4;       ///< behind start and goal, m
};

/// Whether a ball gets from start to goal without touching anything. Where the answer is yes it is proved
/// (every point of the way found is free by the radius); a way with less than 13 cm to spare may be missed.
bool is_passable(const SurfaceDistance& surface, const Eigen::Vector3d& start, const Eigen::Vector3d& goal,
                 const PassageOptions& options = {});

struct OpenWorldScene {
  Scene scene;
  SurfaceDistance surface;  ///< of the scene
  Eigen::Vector3d start;
  Eigen::Vector3d goal;
  int attempt = 0;  ///< of generate_open_world(): how many worlds of this seed had no way through
  std::filesystem::path file = {};  ///< of the world, where it was written by make_open_world()
};

/// As make_open_world(), but nothing, which is no error, where none of the 10 worlds of a seed has a way.
Result<std::optional<OpenWorldScene>> find_open_world(OpenWorldKind kind, std::uint64_t seed, double density,
                                                      const std::filesystem::path& world_file);

/// Writes the first world of this seed that a ball of 0.5 m gets through and builds it. Each attempt has a
/// file of its own, so that no other process puts another one under its name: the first is `world_file`
/// (meshes beside it), the n-th attempt-n/ beside that. Refuses a density out of range, a seed without such a
/// world in 10 attempts, and files that cannot be written.
Result<OpenWorldScene> make_open_world(OpenWorldKind kind, std::uint64_t seed, double density,
                                       const std::filesystem::path& world_file);

}  // namespace pade::simulation
