// Kernels on single planes: conversion, pyramid, resampling, median. See pyramid_kernels.cpp for the
// formulas.
#pragma once

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

PADE_DECLARE_KERNEL(void convert_row_u8(const unsigned char* from, float* to, int width))
PADE_DECLARE_KERNEL(void convert_row_u16(const unsigned short* from, float* to, int width))

/// Half size (rounded up) after the binomial filter [1 4 6 4 1] / 16 both ways, edges repeated. The coarse
/// pixel x lies on the fine pixel 2 x. Rows [first, last) of `to`. `scratch`: padded(from.width) + 2
/// kRowMultiple floats.
PADE_DECLARE_KERNEL(void downsample(PlaneView from, PlaneView to, int first, int last, float* scratch))

/// Twice the size: bilinear, times `factor`. Rows [first, last) of `to`.
PADE_DECLARE_KERNEL(void upsample(PlaneView from, PlaneView to, float factor, int first, int last))

inline constexpr int kLargestSmoothRadius = 8;

/// Separable symmetric filter of radius kLargestSmoothRadius at most, edges repeated; taps[0] is the middle.
/// Rows [first, last). `scratch`: padded(width) + 2 kRowMultiple floats. `from` and `to` differ.
PADE_DECLARE_KERNEL(void smooth(PlaneView from, PlaneView to, const float* taps, int radius, int first,
                                int last, float* scratch))

/// to = from - to, in rows [first, last); the last pixel of each row is repeated behind its end.
PADE_DECLARE_KERNEL(void subtract_from(PlaneView from, PlaneView to, int first, int last))

/// Derivatives along x and y by [1 -8 0 8 -1] / 12, edges repeated. Rows [first, last). `scratch`:
/// 5 (padded(width) + 2 kRowMultiple) floats.
PADE_DECLARE_KERNEL(void gradient(PlaneView from, PlaneView along_x, PlaneView along_y, int first, int last,
                                  float* scratch))

/// Lines of padded(width) + 2 kRowMultiple floats that the kernels of this file need at most.
inline constexpr int kPlaneLines = 15;

/// Median of 3 x 3 or 5 x 5, edges repeated. Rows [first, last). `scratch`: kPlaneLines lines. `from` and
/// `to` differ.
PADE_DECLARE_KERNEL(void median3(PlaneView from, PlaneView to, int first, int last, float* scratch))
PADE_DECLARE_KERNEL(void median5(PlaneView from, PlaneView to, int first, int last, float* scratch))

}  // namespace pade::flow
