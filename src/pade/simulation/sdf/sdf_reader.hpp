// Gazebo's world format (SDF 1.0 to 1.9, http://sdformat.org) read into a World.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"
#include "pade/simulation/sdf/sdf_files.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// Reads the first world of a file (or a lone model, as a world of one), placed by its <state> where it has
/// one. What we cannot show is named in the world's warnings; what cannot be read and touches the picture is
/// an error that names file and line. Models, meshes and images are looked for beside the file that names
/// them, in models/ beside the world, in `resources`, in the folders of GZ_SIM_RESOURCE_PATH,
/// IGN_GAZEBO_RESOURCE_PATH, GAZEBO_MODEL_PATH, GAZEBO_RESOURCE_PATH and SDF_PATH, and in models/ beside the
/// folder of the world; model://sun and model://ground_plane are always there. Not for two threads at once:
/// libsdformat keeps its callbacks globally.
Result<World> read_sdf(const std::filesystem::path& file, const ResourcePaths& resources = {});

}  // namespace pade::simulation
