// A polygon raised to a prism: what SDF calls a polyline.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// The closed prism over a simple polygon (either way round, the last point may repeat the first), from z = 0
/// to `height`, metres. Refused: fewer than three different points, no area, a height that is not positive.
Result<TriangleMesh> extrude(std::vector<Eigen::Vector2d> polygon, double height);

}  // namespace pade::simulation
