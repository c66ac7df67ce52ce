// Depth from motion: the paper's PADE (Section 2.3) in its literal and its exact form, and TTC as compared
// there.
#pragma once

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"
#include "pade/depth/depth_options.hpp"
#include "pade/depth/focus_of_expansion.hpp"

namespace pade::depth {

/// What one pair of frames gives to depth estimation. The images may be empty: then every pixel counts as
/// textured.
struct DepthInput {
  const Camera& camera;                      ///< undistorted pinhole of both frames
  const RelativeMotion& motion;              ///< the other camera seen from the reference
  const FlowField& flow;                     ///< from the reference to the other image, of the camera's size
  Derotation derotation = Derotation::flow;  ///< image: the other image was derotated before matching
  cv::Mat reference{};                       ///< CV_8UC1, the image on whose pixels the depth lives
  cv::Mat other{};                           ///< CV_8UC1, the other image as it was matched
  cv::Mat valid{};  ///< CV_8UC1, 0 where no frame sees anything (lens, airframe); empty = all valid
  /// The rotation (other to reference) that was removed from the image before matching, if it is not
  /// motion.R_reference_other: the motion was refined since.
  std::optional<Eigen::Matrix3d> rotation_removed{};

  /// CV_8UC1, DepthEstimator::gate() of an earlier pair with the same reference and nearly the same direction
  /// of motion, to be used again; empty = it is made.
  cv::Mat texture{};

  /// Directions: what the other image was turned by before matching.
  [[nodiscard]] Eigen::Matrix3d R_removed() const {
    if (derotation == Derotation::flow) return Eigen::Matrix3d::Identity();
    return rotation_removed.value_or(motion.R_reference_other);
  }
  /// Directions: the rotation that is still in the flow.
  [[nodiscard]] Eigen::Matrix3d R_left() const { return motion.R_reference_other * R_removed().transpose(); }
};

/// What was found out about the pair as a whole.
struct DepthDiagnostics {
  double flow_sigma = 0;                  ///< standard deviation of each flow component that was used, px
  double image_noise = 0;                 ///< grey levels; 0 if there were no images
  std::optional<FocusOfExpansion> focus;  ///< TTC only
};

/// Depth, variance and state per pixel from flow and motion. Keeps its buffers between frames; one per
/// thread.
///
/// With a = -A t and D the derotated flow (paper Eq. 1 with the signs of docs/method.md):
///   exact         Z = a.a / a.D + t_z      variance (Z - t_z)^4 sigma^2 / |a|^2 (1 + 18 e^2 + 400 e^4)
///   instantaneous Z = a.a / a.d
///   samelson      Z = a.d / d.d (Eq. 2 as the inverse of a 2-vector), plus t_z if exact
/// (with e = sigma / |D|: the mean squared error of 1/(1/Z) for a log-uniform prior on depth, which is 1 for
/// clear parallax) plus J Sigma J^T if the motion has a covariance Sigma. TTC is the same with the epipole
/// found in the flow (focus of expansion e) in place of the pose's: a = t_z (p - e).
class DepthEstimator {
 public:
  /// Of options that check() accepts.
  explicit DepthEstimator(const DepthOptions& options) : options_(options) {}

  /// @param input  one pair of frames; flow and images of the camera's size.
  /// @param out  Depth image of input.motion's reference frame; its buffers are reused. `out.time` is left
  /// alone.
  void estimate(const DepthInput& input, DepthImage& out);
  /// The same, as a new image.
  DepthImage estimate(const DepthInput& input) {
    DepthImage out;
    estimate(input, out);
    return out;
  }

  /// As given.
  [[nodiscard]] const DepthOptions& options() const { return options_; }
  /// Per pixel of the last estimate(): 0, or the state that image and mask force on it.
  [[nodiscard]] const cv::Mat& gate() const { return gate_; }
  /// Of the last estimate().
  [[nodiscard]] const DepthDiagnostics& diagnostics() const { return diagnostics_; }

 private:
  void make_gate(const DepthInput& input);
  [[nodiscard]] std::vector<FlowSample> sample(const DepthInput& input, double wanted) const;

  DepthOptions options_;
  DepthDiagnostics diagnostics_;
  cv::Mat gate_;        // CV_8UC1 per pixel: 0, or the state that is forced on it
  FlowField averaged_;  // flow per cell where window > 1
  cv::Mat cell_gate_;
  std::vector<float> columns_, sums_;
};

}  // namespace pade::depth
