// Polygons raised to a prism: what SDF calls polylines.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

using Polygon = std::vector<Eigen::Vector2d>;

/// The closed prism over simple polygons that do not cross (either way round, the last point may repeat the
/// first), from z = 0 to `height`, metres. A polygon inside another is a hole, one inside a hole is solid
/// again. Refused: a polygon of fewer than three different points or without area, a height that is not
/// positive.
Result<TriangleMesh> extrude(std::vector<Polygon> polygons, double height);

}  // namespace pade::simulation
