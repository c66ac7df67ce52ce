// What several views say of each pixel, by rows, compiled once per instruction set. Meaning: views_depth.hpp,
// read_views().
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::depth {

/// Constants of one image.
struct ReadParameters {
  float scale, per_scale, scale2;  ///< d = scale / Z, its inverse, its square
  float range;                     ///< m
  float bound_sigmas;              ///< of the bound
  float gate2;                     ///< of the parallax, in its sigmas, squared
  float sigma_scale2, relative2;   ///< of the variance of d
  float largest_parallax2;         ///< px^2, over which a view's motion does not count for a point
  int views;                       ///< whose motions are not exact; 0 = all are
};

/// A row of what the views say: ParallaxField.
struct ReadField {
  const float *distance, *information, *spread, *offset, *matching, *texture;
  /// What their motions err (CommonError::expand): for each view four lines of `width` numbers.
  const float* common;
};

/// A row of the depth image, in and out; and of the bounds that the views give, infinity = none.
struct ReadRow {
  float *depth, *variance, *own_variance, *bound, *of_views;
  std::uint8_t* state;
};

PADE_DECLARE_KERNEL(void read_row(const ReadParameters& p, const ReadField& field, int width,
                                  const ReadRow& row))

}  // namespace pade::depth
