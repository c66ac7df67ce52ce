// What a pinhole camera sees of the world, drawn triangle by triangle: a few milliseconds where rays cost
// many. The same surfaces as the rays find, but for pixels within rounding of an edge.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/simulation/render/raster/raster_kernels.hpp"
#include "pade/simulation/world/geometry.hpp"

namespace pade::simulation {

/// What a camera sees at its pixels' centres.
struct VisibleSurface {
  cv::Mat primitive;  ///< CV_32SC1, the bits of Primitive::id
  cv::Mat depth;      ///< CV_32FC1, exact depth along the optical axis, metres; NaN = nothing
};

class Rasteriser {
 public:
  /// Keeps a reference to the geometry.
  explicit Rasteriser(const Geometry& geometry);

  /// Leaves the camera's distortion out of account. Same bits for any number of threads and on any machine.
  [[nodiscard]] VisibleSurface draw(const Camera& camera, const Pose& T_world_camera, int threads,
                                    simd::InstructionSet set = simd::best()) const;

 private:
  /// Triangles close together: packets [first, last) within a box.
  struct Cluster {
    Eigen::AlignedBox3f box;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
  };
  struct Frame;
  void add_clusters(std::vector<std::uint32_t>& triangles);
  [[nodiscard]] QuadricView quadric_view(const Frame& frame, std::uint32_t quadric,
                                         float nearest_inverse) const;
  void draw_triangles(const Frame& frame, std::size_t index, const RasterTile& tile) const;
  void draw_quadrics(const Frame& frame, std::size_t index, const RasterTile& tile) const;
  void draw_tile(const Frame& frame, int index, VisibleSurface& image) const;

  const Geometry& geometry_;
  std::vector<TrianglePacket> packets_;
  std::vector<std::uint32_t> triangle_of_slot_;
  std::vector<TrianglePlane> planes_;  ///< by slot
  std::vector<Cluster> clusters_;
};

}  // namespace pade::simulation
