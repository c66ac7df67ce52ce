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
struct TreeShape {
  double height = 5.7;         ///< metres
  double trunk_radius = 0.17;  ///< metres
  double crown_base = 0.38;    ///< share of the height up to which the trunk is free
  static TreeShape garden() { return {}; }
  static TreeShape forest() { return {7.5, 0.22, 0.42}; }
};
/// A broad-leaved tree; sizes vary by some 15 %.
TreeMeshes grow_tree(const TreeShape& shape, Random& random);
/// A rough stone of about 1 m across, centred at the origin.
std::string break_stone(Random& random);

}  // namespace pade::simulation
