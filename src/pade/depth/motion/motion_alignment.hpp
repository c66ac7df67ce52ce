// Motion from the depth of the last frame: the newest image is laid over it as a whole (docs/method.md,
// "Motion from the depth so far").
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

/// Options of MotionAligner.
struct MotionAlignmentOptions {
  bool on = true;
  int levels = 3;
  int iterations = 6;
  double relative_sigma = 0.15;
  double inflation = 2;
  double bent_rotation_deg = 0.004;
  double bent_direction_deg = 0.15;
  double rotation_floor_deg = 0.0007;
  double direction_floor_deg = 0.03;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("on", self.on, "whether the newest image is aligned with the depth of the last frame");
    field("levels", self.levels, "images that it is done on, each of half the size of the one before");
    field("iterations", self.iterations, "on each of them, at most");
    field("relative_sigma", self.relative_sigma,
          "pixels whose depth has a larger standard deviation, as share of it, are not used");
    field("inflation", self.inflation,
          "variance of what the images tell, over what the scatter of parts of the image shows");
    field("bent_rotation_deg", self.bent_rotation_deg,
          "by how much the last depth image may be bent as a whole, as the rotation per axis that fits it "
          "best shows");
    field("bent_direction_deg", self.bent_direction_deg,
          "the same of the direction of translation, per axis");
    field("rotation_floor_deg", self.rotation_floor_deg,
          "error of the aligned rotation that all pixels share, per axis");
    field("direction_floor_deg", self.direction_floor_deg,
          "the same of the direction of translation, per axis");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const MotionAlignmentOptions& options);

/// What the alignment works on.
struct AlignmentInput {
  /// A frame before the last.
  struct View {
    const cv::Mat& image;  ///< CV_8UC1
    Pose T_view_last;      ///< of its camera
  };
  const Camera& camera;     ///< undistorted pinhole of all frames
  const cv::Mat& newest;    ///< CV_8UC1, the reference of the motion
  const cv::Mat& last;      ///< CV_8UC1, the frame before
  const DepthImage& depth;  ///< of `last`, window 1
  const RelativeMotion&
      prior;  ///< of `last` seen from `newest`, with its covariance, as the flow has refined it
  const RelativeMotion& start;  ///< where the search begins
  std::vector<View> views{};    ///< further frames that see the same points, shortest baseline first
};

/// The motion between the newest frame and the last.
struct AlignedMotion {
  /// With the covariance that prior and images together leave. The length of its translation is that of the
  /// images alone, in the units of the depth, and so is the length's variance.
  RelativeMotion motion;
  bool aligned = false;     ///< else `motion` is the start
  int pixels = 0;           ///< with depth and texture, in view of both
  double inlier_share = 0;  ///< of them
  double surprise = 0;      ///< squared Mahalanobis distance from the prior, the length left out
};

/// Aligns pairs of frames. Keeps its buffers between frames; one per thread.
///
/// A point of the last frame at X has its image in the newest one at pi(R X + t), where the grey should be
/// what it was but for exposure: r = (I(pi(R X + t)) - offset) / gain - I_last. Robust Gauss-Newton minimises
/// it over (t, R, gain, offset), with the prior as one more measurement, but for the length of t. The depth,
/// of motions that err, is bent as a whole: by itself it would hand on its error from frame to frame. Views
/// farther back see the same points; their greys take the place of I_last, each residual with the variance
/// that the uncertain depth gives it, so that what lies across the epipolar lines of long baselines decides.
class MotionAligner {
 public:
  /// Of options that check() accepts.
  explicit MotionAligner(const MotionAlignmentOptions& options = {}) : options_(options) {}
  /// The motion of one pair. Never fails: if the images tell nothing, `aligned` is false.
  [[nodiscard]] AlignedMotion align(const AlignmentInput& input);
  /// As given.
  [[nodiscard]] const MotionAlignmentOptions& options() const { return options_; }

  /// A point of the last frame.
  struct Point {
    Eigen::Vector3f X;     ///< in its camera, m
    float grey;            ///< grey value
    float gx;              ///< its slope to the right, per px of the level
    float gy;              ///< and downward
    float relative_sigma;  ///< of its depth
    int block;             ///< which part of the image it lies in
  };
  /// What a view has of a point.
  struct Glimpse {
    float grey;          ///< at the exposure of the last frame; NaN = out of view
    float by_log_depth;  ///< d grey / d log Z
  };

 private:
  void select(const AlignmentInput& input, int level);
  void look_from(const AlignmentInput::View& view, const Camera& camera, std::vector<Glimpse>& out);

  MotionAlignmentOptions options_;
  std::vector<cv::Mat> newest_, last_;  // by level
  cv::Mat smooth_;
  std::vector<Point> points_;
  std::vector<std::vector<Glimpse>> glimpses_;  // of each view
};

}  // namespace pade::depth
