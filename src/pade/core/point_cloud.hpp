// Points in the world with what is known about each: what mapping gives, and what PLY and PCD files hold.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace pade {

/// One measured point.
struct CloudPoint {
  float x = 0, y = 0, z = 0;                ///< world frame, metres
  std::array<std::uint8_t, 3> colour = {};  ///< red, green, blue; equal for grey images
  float sigma = 0;                          ///< standard deviation along the viewing ray's depth Z, metres

  bool operator==(const CloudPoint&) const = default;
};

using PointCloud = std::vector<CloudPoint>;

}  // namespace pade
