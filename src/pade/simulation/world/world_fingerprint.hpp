// One number for all that a world shows, to tell whether an unfinished sequence belongs to it.
#pragma once

#include <string>

#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// 16 hexadecimal digits (FNV-1a over shapes, poses, materials, images and light). Not
/// cryptographic: it tells worlds apart.
std::string world_fingerprint(const World& world);

}  // namespace pade::simulation
