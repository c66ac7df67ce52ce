// How far estimated depth is from the truth: the Absolute Depth Error of the paper's Section 3 with the
// protocol of docs/method.md ("Protocol of every accuracy figure"), and whether sigma says so.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/evaluation/log_histogram.hpp"

namespace pade::evaluation {

/// The limits of the ranges of true depth, metres: 0-4, 4-8, 8-12, 12-16 and beyond.
inline constexpr std::array<double, 4> range_limits = {4, 8, 12, 16};
inline constexpr std::size_t range_count = range_limits.size() + 1;

/// Whether a true depth is one: positive and finite.
bool is_truth(float depth);
/// Index of the range that a true depth lies in.
std::size_t range_of(float true_depth);

/// Accuracy over the pixels whose true depth lies in [from, to) metres. NaN where there is nothing to
/// average.
struct RangeAccuracy {
  double from = 0;
  double to = std::numeric_limits<double>::infinity();
  std::uint64_t truth_pixels = 0;  ///< pixels with truth
  std::uint64_t pixels = 0;        ///< of those, with an estimate
  double coverage = 0;             ///< pixels / truth_pixels

  // Over the pixels with an estimate; error = |Z - Z_true|, relative error = error / Z_true.
  double mean = 0;             ///< Absolute Depth Error, metres
  double deviation = 0;        ///< standard deviation of the error, metres
  double median = 0;           ///< of the error, metres; right to 0.05 %
  double relative_mean = 0;    ///< AbsRel
  double relative_median = 0;  ///< right to 0.05 %
  double outliers = 0;         ///< share with a relative error over 25 %

  // Over the pixels that have a sigma as well: (Z - Z_true) / sigma.
  std::uint64_t sigma_pixels = 0;
  double within_1_sigma = 0;  ///< share; 0.68 where sigma is right and errors are normal
  double within_2_sigma = 0;  ///< share; 0.95
  double rms_of_sigma = 0;    ///< root mean square of error / sigma; 1
};

/// The accuracy of a run.
struct DepthAccuracy {
  int frames = 0;        ///< depth images that had truth
  double max_depth = 0;  ///< metres; estimates beyond counted as no depth. 0 = no limit, NaN = several
  std::array<RangeAccuracy, range_count> ranges;
  RangeAccuracy all;  ///< all ranges pooled
};

/// Gathers the accuracy of a run frame by frame in fixed memory.
class Accumulator {
 public:
  /// @param max_depth  metres: estimates beyond it count as no depth and lower the coverage. 0 = no limit.
  /// @param grid       only the pixels (grid / 2 + i grid, grid / 2 + j grid) are looked at: a sample for
  /// many runs.
  explicit Accumulator(double max_depth = 0, int grid = 1);

  /// Compares one depth image with the true depth of the same frame.
  /// @param estimate  any window; a window's depth stands for its n x n pixels.
  /// @param truth     CV_32FC1 on the pixel grid of the undistorted frame, metres along the optical axis;
  /// NaN,
  ///                  infinite or <= 0 = no truth. Empty = nothing is counted.
  void add(const DepthImage& estimate, const cv::Mat& truth);

  [[nodiscard]] bool empty() const { return frames_ == 0; }
  [[nodiscard]] DepthAccuracy result() const;

 private:
  struct Sums {
    std::uint64_t truth = 0, pixels = 0, outliers = 0, with_sigma = 0, in_1_sigma = 0, in_2_sigma = 0;
    double error = 0, error2 = 0, relative = 0, normalised2 = 0;
    LogHistogram errors, relatives;

    void add(float depth, float variance, float true_depth);
    void add(const Sums& other);
    [[nodiscard]] RangeAccuracy result(double from, double to) const;
  };

  double max_depth_;
  int grid_;
  int frames_ = 0;
  std::array<Sums, range_count> ranges_;
};

/// Signed relative error (Z - Z_true) / Z_true per pixel, CV_32FC1 of the size of `truth`; NaN where there is
/// no estimate or no truth.
cv::Mat relative_error(const DepthImage& estimate, const cv::Mat& truth);

/// The mean over several sequences of each figure, sequences that have no value for it left out; counts are
/// summed. `max_depth` is NaN where theirs differ: then the figures are of different things.
DepthAccuracy average(std::span<const DepthAccuracy> sequences);

}  // namespace pade::evaluation
