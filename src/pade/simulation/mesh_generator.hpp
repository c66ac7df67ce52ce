// Meshes of things that no box or cylinder looks like: trees with branches and leaves, broken stone.
#pragma once

#include <string>

#include "pade/core/random.hpp"

namespace pade::simulation {

/// Wavefront OBJ texts of a tree that stands on the origin: trunk with branches, and leaves.
struct TreeMeshes {
  std::string wood;
  std::string leaves;
};
/// A broad-leaved tree of about 6 m whose trunk is free to 2 m.
TreeMeshes grow_tree(Random& random);
/// A rough stone of about 1 m across, centred at the origin.
std::string break_stone(Random& random);

}  // namespace pade::simulation
