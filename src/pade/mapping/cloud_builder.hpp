// One point cloud from the depth images of a flight, thinned to what a person or a program can use.
#pragma once

#include <cstdint>
#include <unordered_map>

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
  std::unordered_map<std::uint64_t, std::size_t> index_;  // cube -> place in cloud_
};

}  // namespace pade::mapping
