#include "pade/offline/camera/camera_odometer.hpp"

#include <cmath>
#include <limits>

#include "pade/depth/derotation.hpp"
#include "pade/flow/methods/clg.hpp"

namespace pade {
namespace {

using depth::RefinedMotion;
using depth::RefinementOutcome;

constexpr double kSearchSigma = 0.4;     // rad, of each direction that is tried
constexpr double kLengthSigma = 0.2;     // of the length
constexpr double kSameDirection = 0.15;  // rad
constexpr double kClearlyWorse = 1.2;    // flow across the lines, over that of the best

/// A translation of which hardly more than the length is known.
RelativeMotion toward(const Eigen::Vector3d& direction, const RelativeMotion& guess) {
  RelativeMotion motion = guess;
  const double length = guess.t_reference_other.norm();
  motion.t_reference_other = length * direction;
  const Eigen::Matrix3d along = direction * direction.transpose();
  motion.covariance.topLeftCorner<3, 3>() =
      length * length *
      (kSearchSigma * kSearchSigma * (Eigen::Matrix3d::Identity() - along) +
       kLengthSigma * kLengthSigma * along);
  motion.covariance.topRightCorner<3, 3>().setZero();
  motion.covariance.bottomLeftCorner<3, 3>().setZero();
  return motion;
}

}  // namespace

std::optional<navigation::CameraMotion> camera_motion(const RefinedMotion& refined, Time older, Time newest,
                                                      const Pose& T_body_camera) {
  if (refined.outcome != RefinementOutcome::refined || refined.images.direction.isZero(0) ||
      refined.images.information.isZero(0))
    return std::nullopt;
  return navigation::CameraMotion{older,
                                  newest,
                                  refined.images.R_reference_other,
                                  refined.images.direction,
                                  refined.images.information,
                                  T_body_camera};
}

CameraOdometer::CameraOdometer(const Camera& camera, const depth::MotionRefinementOptions& options,
                               const cv::Mat& valid, const Pose& T_body_camera)
    : camera_(camera), T_body_camera_(T_body_camera), refiner_(options) {
  flow::ClgOptions guide = flow::clg_guide_options();
  guide.pyramid.confidence = flow::FlowConfidence::local;
  flow_ = flow::make_clg(guide, "clg-guide");
  flow_->set_mask(valid);
  if (!valid.empty()) gate_ = valid == 0;
}

/// Every direction that a step over a face, an edge or a corner of a cube has: none is farther than 0.5 rad
/// from one of them.
RefinedMotion CameraOdometer::search(const depth::RefinementInput& input) {
  std::vector<RefinedMotion> found;
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (step.isZero(0)) continue;
    const RelativeMotion prior = toward(step.normalized(), input.prior);
    RefinedMotion one =
        refiner_.refine({input.camera, prior, input.flow, input.R_removed, input.reference, input.gate});
    if (one.outcome == RefinementOutcome::refined) found.push_back(std::move(one));
  }
  RefinedMotion none;
  none.outcome = RefinementOutcome::inconsistent;
  if (found.empty()) return none;
  std::size_t best = 0;
  for (std::size_t i = 1; i < found.size(); ++i) {
    if (found[i].flow_sigma < found[best].flow_sigma) best = i;
  }
  const Eigen::Vector3d direction = found[best].motion.t_reference_other.normalized();
  for (const RefinedMotion& other : found) {
    const double apart = direction.dot(other.motion.t_reference_other.normalized());
    if (apart < std::cos(kSameDirection) && other.flow_sigma < kClearlyWorse * found[best].flow_sigma)
      return none;
  }
  return found[best];
}

std::optional<navigation::CameraMotion> CameraOdometer::measure(const cv::Mat& older, Time older_time,
                                                                const cv::Mat& newest, Time newest_time,
                                                                const MotionGuess& guess) {
  ++tally_.pairs;
  const cv::Mat seen = depth::derotate_image(older, camera_, guess.motion);
  const FlowField flow = flow_->estimate(newest, seen);
  const depth::RefinementInput input{camera_, guess.motion, flow, guess.motion.R_reference_other,
                                     newest,  gate_};
  const RefinedMotion refined = guess.has_direction ? refiner_.refine(input) : search(input);
  const auto motion = camera_motion(refined, older_time, newest_time, T_body_camera_);
  if (motion) {
    ++tally_.measured;
    tally_.searched += guess.has_direction ? 0 : 1;
  } else if (refined.outcome == RefinementOutcome::hover) {
    ++tally_.still;
  } else if (refined.outcome == RefinementOutcome::inconsistent) {
    ++tally_.refused;
  } else {
    ++tally_.blank;
  }
  return motion;
}

}  // namespace pade
