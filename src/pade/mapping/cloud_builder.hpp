// One point cloud from the depth images of a flight, thinned to what a person or a program can use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/point_cloud.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"

namespace pade::mapping {

struct CloudOptions {
  double spacing = 0.05;
  double largest_relative_sigma = 0.1;
  int step = 2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("spacing", self.spacing, "the best point of each cube of this side is kept, m");
    field("largest_relative_sigma", self.largest_relative_sigma,
          "depths less certain than this share of Z are left out");
    field("step", self.step, "takes every step-th cell of every step-th row");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const CloudOptions& options);

/// Where in a list the thing of a cube is: a hash table of 12 to 24 bytes per cube.
class CubeIndex {
 public:
  /// The place of `cube`; that after the last where it has none, which is its place from then on.
  std::size_t place_of(std::uint64_t cube);

 private:
  [[nodiscard]] std::size_t slot_of(std::uint64_t cube) const;
  void grow();

  std::vector<std::uint64_t> cubes_;  // by place
  std::vector<std::uint32_t> slots_;  // place plus one; 0 = empty
};

/// Keeps, of each small cube of space, the point with the least sigma. The order is that in which cubes were
/// first seen, so that the same images give the same cloud.
class CloudBuilder {
 public:
  /// @param options  that check() accepts
  explicit CloudBuilder(const CloudOptions& options = {}) : options_(options) {}

  /// Arguments as of back_project().
  void add(const DepthImage& image, const Camera& camera, const Pose& T_world_camera,
           const cv::Mat& intensity);

  [[nodiscard]] const PointCloud& cloud() const { return cloud_; }

 private:
  CloudOptions options_;
  PointCloud cloud_;
  CubeIndex index_;  // places in cloud_
};

}  // namespace pade::mapping
