// Which of 64 voxels a depth image shows free, one after the other: compiled once per instruction set, same
// bits on each.
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::mapping {

/// 4 x 4 x 4 voxels in Morton order: their centres in the frame of a camera, m.
struct VoxelCentres {
  double x[64];  // NOLINT(*-avoid-c-arrays)
  double y[64];  // NOLINT(*-avoid-c-arrays)
  double z[64];  // NOLINT(*-avoid-c-arrays)
};

/// A level of the pyramid over the free ends of the rays: cells of 2^level x 2^level pixels.
struct EndsLevel {
  /// Pyramids of the farthest: of pixels, and of the nearest in cells of 2 x 2, 4 x 4 and 8 x 8 pixels.
  static constexpr int kScales = 4;
  const float* nearest = nullptr;  ///< of each cell; readable for eight cells from each
  const float* farthest[kScales] =
      {};          ///< likewise; null below the level of their cells NOLINT(*-avoid-c-arrays)
  int stride = 0;  ///< cells from row to row
};

/// A voxel that covers so many pixels along each axis holds all of a cell of 2^scale x 2^scale: where the
/// nearest of each cell lies before it, it is not free.
inline int scale_of(double pixels) { return pixels >= 15 ? 3 : pixels >= 7 ? 2 : pixels >= 3 ? 1 : 0; }

/// What of a Clearance the kernel needs.
struct LookView {
  double f_x, f_y, c_x, c_y;  ///< pixels
  int width, height;          ///< pixels
  double range;               ///< m
  double voxel;               ///< m
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

/// A rigid motion: rows of the rotation, then the translation.
struct LookMotion {
  double r[9];  // NOLINT(*-avoid-c-arrays)
  double t[3];  // NOLINT(*-avoid-c-arrays)
};

PADE_DECLARE_KERNEL(
    /// `corners`: centres of the eight eighths, x, y, z; `offsets`: from them to their eight voxels, eight x,
    /// y, z.
    void place_voxels(const double* corners, const double* offsets, VoxelCentres& out);
    void move_voxels(const LookMotion& motion, const VoxelCentres& from, VoxelCentres& out);
    void move_corners(const LookMotion& motion, const double* from, double* out);
    /// Of eight cubes of 2 x 2 x 2 voxels, by `corners`, one bit each: those that are free all over, and
    /// those of which nothing is.
    void look_at_eight(const LookView& view, const double* corners, unsigned* free, unsigned* nothing);
    /// Of `asked`, bit by voxel, those that are free.
    std::uint64_t free_voxels(const LookView& view, const VoxelCentres& centres, std::uint64_t asked);
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
