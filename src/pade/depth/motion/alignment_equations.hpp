// The normal equations of MotionAligner at one motion.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/depth/motion/motion_alignment.hpp"

namespace pade::depth {

/// Grey value of an image between its pixels, and its slopes per px.
struct GreySample {
  float grey, gx, gy;
};
/// Bilinear. @param image  CV_8UC1. @return false outside of it, or within a pixel or two of its border
bool sample(const cv::Mat& image, float u, float v, GreySample& out);

/// Unknowns of the alignment: t, rotation, gain, offset.
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;  ///< in the order of Vector8d

inline constexpr int alignment_blocks_across = 6;  ///< parts of the image whose errors are independent

/// Sums over residuals: what they say of a step from where the motion is.
class NormalEquations {
 public:
  /// @param j  derivative of a residual. @param weight  sum of 1/variance. @param moment  of residual /
  /// variance
  void add(const Vector8d& j, double weight, double moment, int block);
  /// To be called once, after the last add().
  void finish();

  Matrix8d information = Matrix8d::Zero();  ///< sum of w j j^T
  Vector8d gradient = Vector8d::Zero();     ///< sum of w r j
  double correlation = 1;  ///< as many residuals count as one: scatter of the blocks' gradients over theirs

 private:
  static constexpr int kBlocks = alignment_blocks_across * alignment_blocks_across;
  Eigen::Matrix<double, 8, kBlocks> of_blocks_ = Eigen::Matrix<double, 8, kBlocks>::Zero();
};

/// Where the alignment stands.
struct AlignmentState {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  double gain = 1, offset = 0;
};

/// What all points say there.
struct AlignmentSums {
  NormalEquations host;   ///< against the last frame
  NormalEquations views;  ///< against those before
  int used = 0;           ///< points in view
  int inliers = 0;        ///< of them: agree with the last frame
  double noise = 0;       ///< of the residuals, robust standard deviation, grey values
  double contrast = 0;    ///< that of the points' greys
};

/// @param camera  of the full image. @param image  newest frame at `level`. @param points, glimpses  of
/// MotionAligner, no views or one glimpse per point of each
AlignmentSums alignment_sums(const Camera& camera, const cv::Mat& image, int level,
                             const std::vector<MotionAligner::Point>& points,
                             const std::vector<std::vector<MotionAligner::Glimpse>>& glimpses,
                             const AlignmentState& at);

}  // namespace pade::depth
