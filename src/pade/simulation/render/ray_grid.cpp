#include "pade/simulation/render/ray_grid.hpp"

#include <algorithm>
#include <limits>

namespace pade::simulation {

RayGrid::RayGrid(const Camera& camera) : camera_(camera) {
  rays_.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({u, v});
      rays_.push_back(ray ? Eigen::Vector2d(ray->head<2>())
                          : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
  }
}

Eigen::Matrix2d RayGrid::step(int column, int row) const {
  Eigen::Matrix2d jacobian = Eigen::Vector2d(1 / camera_.fx, 1 / camera_.fy).asDiagonal();
  if (camera_.is_pinhole()) return jacobian;
  const auto difference = [&](int du, int dv) -> Eigen::Vector2d {
    const int u0 = std::max(column - du, 0);
    const int u1 = std::min(column + du, camera_.width - 1);
    const int v0 = std::max(row - dv, 0);
    const int v1 = std::min(row + dv, camera_.height - 1);
    return (ray(u1, v1) - ray(u0, v0)) / std::max(u1 - u0 + v1 - v0, 1);
  };
  const Eigen::Vector2d right = difference(1, 0);
  const Eigen::Vector2d down = difference(0, 1);
  if (right.allFinite()) jacobian.col(0) = right;  // at the rim of the lens a neighbour may not exist
  if (down.allFinite()) jacobian.col(1) = down;
  return jacobian;
}

}  // namespace pade::simulation
