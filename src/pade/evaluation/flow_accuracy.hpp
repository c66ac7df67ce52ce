// How far an estimated flow is from the true one, in the measures of the Middlebury and KITTI benchmarks.
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

namespace pade::evaluation {

/// Errors of a flow field over the pixels whose truth is known. Pixels without an estimate (NaN) lower the
/// coverage and count as wrong in the outlier shares, but do not enter the two averages.
struct FlowAccuracy {
  std::size_t known = 0;      ///< pixels with truth
  double coverage = 0;        ///< share of those with an estimate, 0 to 1
  double endpoint_error = 0;  ///< AEE: mean |w - w_true|, pixels; NaN where nothing was compared
  double angular_error =
      0;                  ///< AAE: mean angle between (u, v, 1) and the truth, degrees (Barron et al. 1994)
  double over_half = 0;   ///< R0.5: share with end-point error > 0.5 px, 0 to 1
  double over_one = 0;    ///< R1
  double over_three = 0;  ///< R3
  double outliers = 0;    ///< Fl (KITTI 2015): share with error > 3 px and > 5 % of the true length
};

/// Compares an estimate with the truth.
/// @param estimate, truth  CV_32FC2 of one size, pixels, NaN = unknown (truth beyond 1e9 is unknown too).
FlowAccuracy flow_accuracy(const cv::Mat& estimate, const cv::Mat& truth);

/// A pixel with a larger standard deviation counts as flagged, pixels: the error that makes a pixel wrong, 3
/// px, is five of it. One threshold for all methods.
inline constexpr float kDoubtfulSigma = 0.6F;

/// Whether a flow's standard deviations know where it is wrong.
struct FlowConfidenceAccuracy {
  double kept_endpoint_error = 0;  ///< AEE of the 70 % of compared pixels with the smallest sigma, pixels
  double flagged =
      0;  ///< of the pixels more than 3 px off, the share with sigma > kDoubtfulSigma; NaN where none
  double trusted = 0;  ///< of the others, the share with sigma <= kDoubtfulSigma
  double within = 0;   ///< share of the components of all errors within one sigma; 68 % for Gaussian errors
  /// Sparsification: AEE of the pixels that remain without the least sure i %, for i = 0, 5, ... 95.
  std::vector<double> remaining;
  /// And without the i % with the largest true error, which no sigma can beat.
  std::vector<double> best_remaining;
};

/// @param estimate, truth  as for flow_accuracy(). @param sigma  CV_32FC1 of their size, pixels.
FlowConfidenceAccuracy flow_confidence_accuracy(const cv::Mat& estimate, const cv::Mat& sigma,
                                                const cv::Mat& truth);

/// End-point error per pixel, CV_32FC1; NaN where truth or estimate is unknown.
cv::Mat endpoint_errors(const cv::Mat& estimate, const cv::Mat& truth);

}  // namespace pade::evaluation
