// Where the search of several views starts, by rows, compiled once per instruction set. Meaning:
// views_depth.hpp, start_of_views().
#pragma once

#include "pade/core/compute/simd.hpp"

namespace pade::depth {

/// Constants of one image.
struct StartParameters {
  float fx, fy, cx, cy;
  float fx_tx, fy_ty, tz;  ///< of the pair's translation, first two times the focal length
  float damping;           ///< px^2 m^2: what |a|^2 must exceed for flow to say something of depth
  float most;              ///< 1/m, inverse of the least depth
  const float* last;       ///< inverse depth of the last frame; null = none
  int last_stride;         ///< in floats
  int width, height;       ///< of the image, the last one too
  float R[9], t[3];        ///< reference -> last camera
  float agreement, slack;
  float untold;  ///< 1/m: what is less shows no parallax in the pair
};

/// @param depth  two-view depth of the row, m, NaN or 0 = none. @param flow  interleaved (u, v), px. @param
/// rho inverse depth to start from, 1/m
PADE_DECLARE_KERNEL(void start_row(const StartParameters& p, int y, const float* depth, const float* flow,
                                   float* rho))

}  // namespace pade::depth
