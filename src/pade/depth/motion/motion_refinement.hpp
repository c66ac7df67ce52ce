// Motion refined by the images: rotation and direction of translation from the flow across its epipolar lines
// (docs/method.md, "Motion from the images"). The length of the baseline stays that of the pose.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

/// Options of MotionRefiner.
struct MotionRefinementOptions {
  bool on = true;
  int pixels = 1200;
  double least_sigma = 0.02;
  double inflation = 2;
  double rotation_floor_deg = 0.0007;
  double direction_floor_deg = 0.03;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("on", self.on, "whether rotation and direction of translation are refined by the flow");
    field("pixels", self.pixels, "cells of the image, each of which gives its best pixel");
    field("least_sigma", self.least_sigma, "flow across the epipolar lines is never trusted more, px");
    field(
        "inflation", self.inflation,
        "variance of what the flow tells, over what the scatter of parts of the image shows: dense flow has "
        "errors that reach farther");
    field("rotation_floor_deg", self.rotation_floor_deg,
          "error of the refined rotation that all pixels share (calibration, smoothness of the flow), per "
          "axis");
    field("direction_floor_deg", self.direction_floor_deg,
          "the same of the refined direction of translation, per axis");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const MotionRefinementOptions& options);

/// What became of the prior.
enum class RefinementOutcome {
  refined,         ///< the images have corrected it
  off,             ///< the options say so
  exact_prior,     ///< its covariance is zero: there is nothing to refine
  hover,           ///< the flow has no parallax to speak of: rotation and translation cannot be told apart
  too_few_pixels,  ///< blank, masked, out of view, or too few that agree with any motion
  degenerate,      ///< the flow tells no more than the prior did
  inconsistent,    ///< the flow contradicts the prior by more than both can explain: something that moves
                   ///< fills the view, or the prior's covariance is too small
};

/// Rotation and direction of translation as the images alone show them, without the prior.
struct ImageMotion {
  Eigen::Matrix3d R_reference_other = Eigen::Matrix3d::Identity();  ///< directions: other -> reference
  Eigen::Vector3d direction =
      Eigen::Vector3d::Zero();  ///< of t_reference_other, norm 1; zero if none was found
  /// Inverse covariance of (direction, rotation vector) in the order and axes of RelativeMotion::covariance,
  /// rad^-2. What the images hardly tell has zeros: there the motion is that of the prior.
  Matrix6d information = Matrix6d::Zero();
};

/// Motion of the pair, and how it was found. If `outcome` is not `refined`, the motion is the prior.
struct RefinedMotion {
  RelativeMotion motion;                               ///< with its 6x6 covariance
  RefinementOutcome outcome = RefinementOutcome::off;  ///< what became of the prior
  int pixels = 0;                                      ///< that had flow to judge by
  double inlier_share = 0;           ///< of them: within the robust limit of their epipolar lines
  double flow_sigma = 0;             ///< robust standard deviation of the flow across the lines, px
  double correlation = 1;            ///< as many of those pixels count as one independent pixel
  double surprise = 0;               ///< squared Mahalanobis distance from the prior to the refined motion
  double length_sigma_relative = 0;  ///< standard deviation of |t| over |t|; infinite if t = 0
  double direction_sigma = 0;        ///< largest standard deviation of the direction of t, rad
  bool direction_valid = false;      ///< direction_sigma is less than 0.1 rad (6 degrees)
  /// Rotation that the images ask for, rad: R_reference_other = exp(turn) R of the prior. Also if they
  /// contradict the prior (`inconsistent`); zero if nothing was solved for.
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  /// What `turn` shows of a true error of the prior's rotation: the identity where the images know all of it,
  /// zero where the prior alone speaks.
  Eigen::Matrix3d turn_gain = Eigen::Matrix3d::Zero();
  /// For a filter that knows the prior already; empty unless `refined`, or where the prior is partly exact.
  ImageMotion images{};
};

/// What a pair of frames gives to the refinement.
struct RefinementInput {
  const Camera& camera;         ///< undistorted pinhole of both frames
  const RelativeMotion& prior;  ///< with covariance; zero = exact
  const FlowField& flow;        ///< from the reference to the other image as it was matched, px; NaN = none
  /// Rotation R_reference_other that was taken out of the other image before matching (derotate_image());
  /// identity if none was.
  Eigen::Matrix3d R_removed = Eigen::Matrix3d::Identity();
  cv::Mat reference{};  ///< CV_8UC1, tells where there is texture; empty = everywhere
  cv::Mat gate{};       ///< CV_8UC1, 0 = usable; empty = all is
};

/// Refines the motion of pairs of frames. Keeps its buffers between frames; one per thread.
///
/// With b = R R_removed^T ((p + w)/f, 1), D = f b_xy/b_z - p and a = -A t, the component of D across a is
/// zero for the right motion and static points at any depth. Robust Gauss-Newton minimises it over rotation
/// and direction of translation, with the prior's covariance as one more measurement.
class MotionRefiner {
 public:
  /// Of options that check() accepts.
  explicit MotionRefiner(const MotionRefinementOptions& options = {}) : options_(options) {}

  /// The motion of one pair. Never fails: if it cannot be refined, the outcome says why.
  [[nodiscard]] RefinedMotion refine(const RefinementInput& input);

  /// As given.
  [[nodiscard]] const MotionRefinementOptions& options() const { return options_; }

  /// A pixel's flow as the refinement reads it.
  struct Match {
    Eigen::Vector2d p;    ///< pixel of the reference, relative to the principal point
    Eigen::Vector3d ray;  ///< its match as a direction in the other camera's frame, z = 1 before turning
    double sigma;         ///< standard deviation of its flow in relation to that of the others
    int block;            ///< which block of neighbouring pixels it belongs to
  };

 private:
  void select(const RefinementInput& input);

  MotionRefinementOptions options_;
  std::vector<Match> matches_;
};

/// Fills in `length_sigma_relative`, `direction_sigma` and `direction_valid` from the motion.
void state_length_and_direction(RefinedMotion& motion);

/// Flow across the epipolar line of one match, and its derivatives.
struct AcrossLine {
  double residual;  ///< px; NaN if the match lies behind the camera or there is no line (a = 0)
  double along;     ///< flow along the line, away from the epipole where t_z < 0: the parallax, px
  double length;    ///< |a|, px m
  Eigen::RowVector3d by_translation;  ///< of `residual` by t, px/m
  Eigen::RowVector3d by_rotation;     ///< of `residual` by theta in exp(theta) R, px/rad
};
/// That of one match under the motion (R, t) = (R_reference_other, t_reference_other).
AcrossLine across_line(const Camera& camera, const Eigen::Vector3d& t, const Eigen::Matrix3d& R,
                       const MotionRefiner::Match& match);

}  // namespace pade::depth

template <>
struct pade::EnumNames<pade::depth::RefinementOutcome> {
  using Outcome = pade::depth::RefinementOutcome;
  static constexpr std::array names = {std::pair{Outcome::refined, std::string_view("refined")},
                                       std::pair{Outcome::off, std::string_view("off")},
                                       std::pair{Outcome::exact_prior, std::string_view("exact prior")},
                                       std::pair{Outcome::hover, std::string_view("hover")},
                                       std::pair{Outcome::too_few_pixels, std::string_view("too few pixels")},
                                       std::pair{Outcome::degenerate, std::string_view("degenerate")},
                                       std::pair{Outcome::inconsistent, std::string_view("inconsistent")}};
};
