// Pose-aided flow: where the epipolar lines are known, one unknown per pixel is left, the distance along the
// line.
#pragma once

#include <memory>
#include <string>

#include <opencv2/core.hpp>

#include "pade/core/flow_field.hpp"
#include "pade/flow/methods/clg.hpp"
#include "pade/flow/methods/lucas_kanade.hpp"

namespace pade::flow {

/// The line of every pixel p of the first image: a static point seen there lies at p + base + distance *
/// direction in the second one. Both follow from the relative pose, exactly and for any motion: base is the
/// flow of a point at infinity (the rotation's homography), direction points to where nearer points are seen.
/// Whoever knows the pose computes them; this room does not.
struct EpipolarField {
  cv::Mat base;       ///< CV_32FC2, pixels; empty = zero (the rotation has been removed from an image)
  cv::Mat direction;  ///< CV_32FC2, unit vectors; zero or NaN where the line is not defined (the epipole)
};

/// Flow along epipolar lines.
struct EpipolarFlow {
  FlowField flow;    ///< base + distance * direction; sigma is that of the distance
  cv::Mat distance;  ///< CV_32FC1, pixels from the point at infinity; negative = behind the camera or wrong
  /// CV_32FC1, pixels: by how much the images ask to leave the line at the solution. Large where the point
  /// moves by itself or the match is wrong, or where the pose is.
  cv::Mat across;

  [[nodiscard]] bool empty() const { return distance.empty(); }
};

/// One-dimensional Lucas-Kanade or CLG. An object keeps buffers between calls: use one per thread.
class EpipolarEstimator {
 public:
  EpipolarEstimator() = default;
  EpipolarEstimator(const EpipolarEstimator&) = delete;
  EpipolarEstimator& operator=(const EpipolarEstimator&) = delete;
  virtual ~EpipolarEstimator() = default;

  /// @param first, second  CV_8UC1 or CV_16UC1 of one size.
  /// @param lines          of that size.
  /// @param initial        CV_32FC1 of that size, pixels: distances predicted from the last depth; empty =
  /// zero,
  ///                       NaN, and distances that leave the image, count as zero.
  /// @return an empty result where types or sizes do not fit.
  virtual EpipolarFlow estimate(const cv::Mat& first, const cv::Mat& second, const EpipolarField& lines,
                                const cv::Mat& initial) = 0;
  EpipolarFlow estimate(const cv::Mat& first, const cv::Mat& second, const EpipolarField& lines) {
    return estimate(first, second, lines, cv::Mat());
  }
};

/// One unknown converges sooner than two: fewer iterations, warps and sweeps.
LucasKanadeOptions epipolar_lucas_kanade_options();
ClgOptions epipolar_clg_options();

/// The options are those of the general methods; `pyramid.threads` and `pyramid.half_resolution` have no
/// effect here. With pyramid.confidence = none neither sigma nor `across` is computed.
std::unique_ptr<EpipolarEstimator> make_epipolar_lucas_kanade(
    const LucasKanadeOptions& options = epipolar_lucas_kanade_options());
std::unique_ptr<EpipolarEstimator> make_epipolar_clg(const ClgOptions& options = epipolar_clg_options());

}  // namespace pade::flow
