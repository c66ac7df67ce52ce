// Image pyramids of floats and what all coarse-to-fine methods do with them.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/flow_field.hpp"
#include "pade/flow/pyramid/plane.hpp"

namespace pade::flow {

/// A pyramid with factor 2: level 0 is the image, grey values 0 to 255.
struct Pyramid {
  std::vector<Plane> levels;

  /// @param image  CV_8UC1 or CV_16UC1 (divided by 257). @param count  levels, >= 1.
  void build(const cv::Mat& image, int count);
};

/// Levels until the shorter side would fall below `smallest`, at least 1.
int pyramid_levels(cv::Size size, int smallest);

/// The window exp(-x^2 / 2 sigma^2), cut at `radius` and normalised to sum 1 over -radius to radius: taps 0
/// to radius.
std::vector<float> gaussian_taps(double sigma, int radius);

/// The Gaussian window of a local mean with this standard deviation, as far as smooth() reaches; empty for 0.
std::vector<float> local_mean_taps(double sigma);

/// Number of independent residuals in the separable window of these taps: half of 1 / sum of squared weights,
/// for what is left after a warp (interpolation, edges, occlusion) is alike in neighbouring pixels. With the
/// half about 68 % of Middlebury's errors lie within one standard deviation.
double effective_window(const std::vector<float>& taps);

/// The flow of one level.
struct FlowPlanes {
  Plane u;
  Plane v;

  void resize(int width, int height);
};

/// Splits CV_32FC2 of the full size into `flow` at 1 / 2^level of it, averaging blocks; NaN, and what leaves
/// any image of this size, counts as zero.
void load_flow(const cv::Mat& vectors, int level, FlowPlanes& flow);
/// Interleaves into CV_32FC2.
cv::Mat to_vectors(const FlowPlanes& flow);

}  // namespace pade::flow
