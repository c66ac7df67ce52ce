// Gazebo's world format (SDF 1.0 to 1.9, http://sdformat.org) read into a World.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"
#include "pade/simulation/sdf/sdf_files.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// Reads the first world of a file (or a lone model, as a world of one). What we cannot show is named in the
/// world's warnings; what cannot be read is an error that names file and line. `resources` come after the
/// folder of the file and its sub-folder models/, and before the folders in GZ_SIM_RESOURCE_PATH,
/// IGN_GAZEBO_RESOURCE_PATH and SDF_PATH.
Result<World> read_sdf(const std::filesystem::path& file, const ResourcePaths& resources = {});

}  // namespace pade::simulation
