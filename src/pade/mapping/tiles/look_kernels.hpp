// Which cubes of space a depth image shows free, eight at once: compiled once per instruction set, same bits
// on each.
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::mapping {

/// A level of the pyramid over the free ends of the rays: cells of 2^level x 2^level pixels.
struct EndsLevel {
  /// Pyramids of the farthest: of pixels, and of the nearest in cells of 2 x 2, 4 x 4 and 8 x 8 pixels.
  static constexpr int kScales = 4;
  const float* nearest = nullptr;  ///< of each cell; readable for eight cells from each
  const float* farthest[kScales] =
      {};          ///< likewise; null below the level of their cells NOLINT(*-avoid-c-arrays)
  int stride = 0;  ///< cells from row to row
};

/// What of a Clearance the kernel needs.
struct LookView {
  double f_x, f_y, c_x, c_y;  ///< pixels
  int width, height;          ///< pixels
  double range;               ///< m
  double voxel;               ///< m
  /// From the centre of 2 x 2 x 2 voxels to theirs, along the axes of the camera: all x, all y, all z, m.
  double offsets[24];  // NOLINT(*-avoid-c-arrays)
  double
      reach[3];  ///< half extents of a cube of side 1 along the axes of the camera NOLINT(*-avoid-c-arrays)
  double sides[4][3];    ///< inward normals of the viewing frustum NOLINT(*-avoid-c-arrays)
  double side_reach[4];  ///< half extents of a cube of side 1 along them NOLINT(*-avoid-c-arrays)
  const EndsLevel* levels;
  int level_count;
};

/// What kernels take of a row of a depth image; all but `depth` may be null.
struct DepthRow {
  const float* depth;
  const float* variance;
  const float* own_variance;
  const unsigned char* state;  ///< 0 = measured
  int count;
};

/// What place_row() knows of a row of pixels: pixel u lies at origin + z (start + u step), all in voxels'
/// axes, m.
struct PixelRays {
  double origin[3];  // NOLINT(*-avoid-c-arrays)
  double start[3];   // NOLINT(*-avoid-c-arrays)
  double step[3];    // NOLINT(*-avoid-c-arrays)
  double per_voxel;
};

/// Of pixels that have no point, and of points beyond what can be addressed.
inline constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};
inline constexpr std::uint64_t kPointOutside = kNoPoint - 1;

/// Of eight cubes, one bit each.
struct Eighths {
  unsigned free;     ///< all over
  unsigned nothing;  ///< of it is free
  unsigned inside;   ///< the view as a whole
};

/// A rigid motion: rows of the rotation, then the translation.
struct LookMotion {
  double r[9];  // NOLINT(*-avoid-c-arrays)
  double t[3];  // NOLINT(*-avoid-c-arrays)
};

PADE_DECLARE_KERNEL(
    /// Eight points: all x, all y, all z, here and below.
    void move_eight(const LookMotion& motion, const double* from, double* out);
    /// What of eight cubes is known.
    /// @param centres  in the frame of the camera, m
    /// @param side     of each, m: two voxels at least
    /// @param wanted   of the eight, a bit each; what is said of the others is of no account
    Eighths look_at_eight(const LookView& view, const double* centres, double side, unsigned wanted);
    /// Of `asked` among 4 x 4 x 4 voxels, in Morton order a bit each, those that are free.
    /// @param centres  of the eight cubes of 2 x 2 x 2. @param inside  those that lie in the view as a whole
    std::uint64_t free_voxels(const LookView& view, const double* centres, std::uint64_t asked,
                              unsigned inside);
    /// Z - margin_sigmas sigma of a row, from 0 to the range; NaN where nothing was measured (state 0) or
    /// sigma is not finite. `variance` and `state` may be null: exact, all measured.
    void measured_row(const float* depth, const float* variance, const unsigned char* state, int count,
                      double margin_sigmas, double range, float* ends);
    /// Depths that may place a point, else NaN: above 0 and up to `farthest`, variance up to limit Z^2.
    /// Counts those that fail the limit alone, and among the usable ones those whose own variance is above
    /// `spread`.
    void usable_depths(const DepthRow& row, double farthest, double limit, double spread, double* z,
                       int* uncertain, int* to_spread);
    /// The voxel of each pixel: x | y << 16 | z << 32, or kNoPoint where z is NaN, or kPointOutside.
    void place_row(const PixelRays& rays, const double* z, int count, std::uint64_t* keys);
    /// Of each value how many of the depths, which ascend, it reaches: below 128. NaN reaches none.
    void rank_all(const float* values, int count, const float* depths, int depth_count, unsigned char* ranks);
    /// Nearest and farthest of 2 x 2 cells of two rows of `width` cells, which may be the same row.
    void halve_nearest(const float* a, const float* b, int width, float* out);
    void halve_farthest(const float* a, const float* b, int width, float* out))

}  // namespace pade::mapping
