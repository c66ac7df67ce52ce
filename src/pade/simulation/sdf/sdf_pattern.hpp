// Our own element <pade:pattern> of a material.
#pragma once

#include <filesystem>

#include <sdf/sdf.hh>

#include "pade/core/result.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// Puts the pattern of a <material> into `material`, if it has one.
/// @param element  null = none. @param file  that it is from, for messages
Status read_pattern(const sdf::ElementPtr& element, const std::filesystem::path& file, Material& material);

}  // namespace pade::simulation
