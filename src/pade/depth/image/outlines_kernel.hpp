// What rays through patches without texture meet, by rows, compiled once per instruction set. Meaning:
// outlines.cpp.
#pragma once

#include "pade/core/compute/simd.hpp"

namespace pade::depth {

inline constexpr int kOutlineRays = 4;  ///< along the row, to the row before, and to both sides of it
/// Vectors are whole: what lies up to so many elements behind a row may be read and written.
inline constexpr int kOutlineSlack = 16;

/// For the pixels of a row, what half of their rays meet first: inverse bound there (infinity = unknown,
/// negative = the border of the image), and steps to there. Pixels -1 and `width` are the border.
struct OutlineRow {
  float* rho[kOutlineRays];
  float* steps[kOutlineRays];
};

/// From `before` to `here`.
/// @param own  inverse bound of each pixel; negative = open: it has none of its own, and rays go through it.
/// @param step  1 or -1: the way in which pixels of the row come one after the other
PADE_DECLARE_KERNEL(void outline_row(const float* own, int width, int step, const OutlineRow& before,
                                     const OutlineRow& here))

/// Inverse bounds from both halves, infinity = none. `a` and `b` point at the first of `count` pixels.
PADE_DECLARE_KERNEL(void outline_bounds(const OutlineRow& a, const OutlineRow& b, int count, float* rho))

}  // namespace pade::depth
