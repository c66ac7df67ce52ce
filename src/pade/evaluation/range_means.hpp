// Mean absolute depth errors per range in a few numbers: for the many draws of a noise experiment, and for
// the pixels where two methods both have an answer.
#pragma once

#include <array>
#include <cstdint>

#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/evaluation/depth_accuracy.hpp"

namespace pade::evaluation {

/// Sums over the pixels of each range of true depth (range_limits).
struct RangeMeans {
  std::array<std::uint64_t, range_count> truth{};   ///< pixels with truth
  std::array<std::uint64_t, range_count> pixels{};  ///< of those, with an estimate
  std::array<double, range_count> error{};          ///< sum of |Z - Z_true|, m

  /// Compares one depth image with the truth on the pixels (grid / 2 + i grid, grid / 2 + j grid).
  /// @param true_depth  CV_32FC1, m; NaN, infinite or <= 0 = none.
  /// @param max_depth   m; estimates beyond are none.
  /// @param where       only where this other depth image of the frame (of any window) has an estimate, too.
  void add(const DepthImage& estimate, const cv::Mat& true_depth, double max_depth, int grid,
           const DepthImage* where = nullptr);

  [[nodiscard]] double mean(std::size_t range) const;      ///< m; NaN if there is nothing
  [[nodiscard]] double coverage(std::size_t range) const;  ///< pixels / truth; NaN if there is nothing

  bool operator==(const RangeMeans&) const = default;
};

}  // namespace pade::evaluation
