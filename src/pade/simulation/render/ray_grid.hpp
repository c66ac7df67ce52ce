// The viewing ray of every pixel, computed once per camera: lens distortion costs nothing per frame.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"

namespace pade::simulation {

class RayGrid {
 public:
  explicit RayGrid(const Camera& camera);

  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// (x/z, y/z) of the pixel's centre; NaN where the lens sees nothing.
  [[nodiscard]] const Eigen::Vector2d& ray(int column, int row) const {
    return rays_[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width) +
                 static_cast<std::size_t>(column)];
  }
  /// How (x/z, y/z) changes from pixel to pixel: the columns belong to one pixel right and one pixel down.
  [[nodiscard]] Eigen::Matrix2d step(int column, int row) const;

 private:
  Camera camera_;
  std::vector<Eigen::Vector2d> rays_;
};

}  // namespace pade::simulation
