// Points in the world with what is known about each: what mapping gives, and what PLY and PCD files hold.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace pade {

/// One measured point.
struct CloudPoint {
  /// @{
  /// World frame, metres.
  float x = 0, y = 0, z = 0;
  /// @}
  std::array<std::uint8_t, 3> colour = {};  ///< red, green, blue; equal for grey images
  float sigma = 0;                          ///< standard deviation along the viewing ray's depth Z, metres

  bool operator==(const CloudPoint&) const = default;  ///< all fields are equal
};

/// In the order in which they were measured.
using PointCloud = std::vector<CloudPoint>;

}  // namespace pade
