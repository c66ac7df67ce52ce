// Which triangle is nearest at each pixel of a tile, and how far exactly; the formulas are in
// raster_kernels.cpp.
#pragma once

#include <cstdint>

#include "pade/core/compute/simd.hpp"

namespace pade::simulation {

/// Pixels are taken by blocks of 4 x 4, in the order of a RayPacket's lanes; triangles by as many.
inline constexpr int raster_side = 4;
inline constexpr int raster_lanes = raster_side * raster_side;

/// Sixteen triangles: corner, axis, lane; metres in the world. Lanes without a triangle have equal corners.
struct TrianglePacket {
  alignas(64) float corner[3][3][raster_lanes];
};

/// The plane of a triangle: normal . p = offset.
struct TrianglePlane {
  double normal[3];
  double offset;
};

/// A pinhole camera in the world. The tables hold (u - cx) / fx and (v - cy) / fy: of each lane, block by
/// block from the image's first; of each block's first pixel; and of each pixel in double precision.
struct RasterView {
  double origin[3];
  double rotation[9];  ///< camera from world, row by row
  float fx, fy, cx, cy;
  const float* x_of_lanes;
  const float* y_of_lanes;
  const float* x_of_blocks;
  const float* y_of_blocks;
  const double* x_of_pixels;
  const double* y_of_pixels;
};

/// A part of the image, by blocks. Buffers hold its blocks row by row; a slot is 16 x packet + lane.
struct RasterTile {
  int left, top;            ///< first block
  int columns, rows;        ///< blocks; columns are a multiple of 16
  float* inverse_depth;     ///< of the nearest so far, 0 = nothing
  std::uint32_t* slot;      ///< what that is
  float* farthest_inverse;  ///< per block, the least of its pixels: what is farther than that is hidden
};

/// A quadric of quadric.hpp: its ray is origin + t direction * (x, y, 1) in the coordinates of the unit
/// shape.
struct QuadricView {
  double origin[3];
  double direction[9];  ///< row by row
  bool round_in_z;      ///< a sphere
  bool capped;          ///< a cylinder with its discs
  float nearest;        ///< no inverse depth of it is larger
  std::uint32_t slot;
};

/// Draws packets [first, last).
PADE_DECLARE_KERNEL(void raster_triangles(const RasterView& view, const TrianglePacket* packets,
                                          std::uint32_t first, std::uint32_t last, const RasterTile& tile))
/// Draws the shape within columns [x0, x1] and rows [y0, y1] of the tile's blocks.
PADE_DECLARE_KERNEL(void raster_quadric(const RasterView& view, const QuadricView& quadric,
                                        const RasterTile& tile, int x0, int x1, int y0, int y1))
/// Depth of the blocks' pixels in double precision, rounded to float: from the plane of the slot, or 1 /
/// inverse_depth where the plane is seen edge on or the slot's highest bit says that there is none; NaN where
/// there is nothing.
PADE_DECLARE_KERNEL(void raster_depth(const RasterView& view, const TrianglePlane* planes,
                                      const RasterTile& tile, float* depth))

}  // namespace pade::simulation
