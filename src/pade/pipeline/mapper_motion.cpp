// The motion of the newest frame, as ObstacleMapper refines it by the images.
#include <cmath>
#include <optional>
#include <vector>

#include "pade/pipeline/obstacle_mapper.hpp"
#include "pade/pipeline/stopwatch.hpp"

namespace pade {
namespace {

constexpr double kScaleDrift = 1e-5;  // variance of the logarithm, from frame to frame
constexpr double kLengthGate = 16;    // four sigmas
constexpr double kUnsureTurn = 0.02;  // rad
constexpr double kTie = 0.1;          // of a frame to the one just before it

/// What an alignment says of the length of the step.
std::optional<depth::BaselineWindow::Seen> length_seen(const depth::AlignedMotion& aligned, int steps) {
  const Eigen::Vector3d& t = aligned.motion.t_reference_other;
  const double squared = t.squaredNorm();
  if (!aligned.aligned || !(squared > 0)) return std::nullopt;
  const double along = t.dot(aligned.motion.covariance.topLeftCorner<3, 3>() * t) / squared;
  return depth::BaselineWindow::Seen{std::sqrt(squared), along / squared + kScaleDrift, steps};
}

}  // namespace

depth::RefinedMotion ObstacleMapper::refined(const Pair& pair, const RelativeMotion& prior,
                                             const Eigen::Matrix3d& removed, const Frame& reference) {
  cv::Mat unseen;
  if (!valid_.empty()) unseen = valid_ == 0;
  return refiner_.refine({camera_, prior, pair.flow, removed, reference.image, unseen});
}

void ObstacleMapper::refine(Pair& pair, const TrackedFrame& newest, const Frame& reference) {
  const Stopwatch watch(update_, Stage::refine);
  const RelativeMotion prior = pair.motion;
  const bool image = options_.derotation == depth::Derotation::image;
  const Eigen::Matrix3d removed =
      image ? prior.R_reference_other : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  update_.refinement = refined(pair, prior, removed, reference);
  pair.motion = update_.refinement.motion;
  using depth::RefinementOutcome;
  const bool asked = options_.order == Order::newest && options_.step == 1 &&
                     update_.refinement.outcome != RefinementOutcome::off &&
                     update_.refinement.outcome != RefinementOutcome::exact_prior;
  if (!asked) return;
  // What poses and images disagree about must not be held to be right: the prior of the rotation is loose
  // here.
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gain = Eigen::Matrix3d::Zero();
  if (clock_.is_telling(newest.frame.time, newest.given, newest.rate)) {
    RelativeMotion loose = prior;
    loose.covariance.bottomRightCorner<3, 3>() += kUnsureTurn * kUnsureTurn * Eigen::Matrix3d::Identity();
    const depth::RefinedMotion seen = refined(pair, loose, removed, reference);
    turn = seen.turn;
    gain = seen.turn_gain;
  }
  clock_.add(newest.frame.time, newest.given, newest.rate, turn, gain);
  health_.stamp_offset = clock_.found();
}

/// Aligns the newest frame with the depth of the last one.
depth::AlignedMotion ObstacleMapper::align(const Pair& pair, const Frame& newest) {
  const Frame& last = recent_.last().frame;
  if (update_.views == 0 || update_.depth.time != last.time) return {pair.motion};
  depth::AlignmentInput input{camera_, newest.image, last.image, update_.depth, pair.motion, pair.motion};
  for (const int frames : seen_from_) {
    if (frames >= recent_.size()) break;
    const Frame& view = recent_.before(frames + 1).frame;
    input.views.push_back({view.image, view.T_world_camera.inverse() * last.T_world_camera});
  }
  return aligner_.align(input);
}

/// The motion of the pair by the depth of the last frame, if there is one, and its length by those of the
/// steps before.
void ObstacleMapper::refine_by_depth(const RelativeMotion& given, Pair& pair, const Frame& newest) {
  const Stopwatch watch(update_, Stage::refine);
  using depth::RefinementOutcome;
  depth::RefinedMotion& refinement = update_.refinement;
  const bool asked = options_.alignment.on && options_.step == 1;
  if (!asked || refinement.outcome == RefinementOutcome::off ||
      refinement.outcome == RefinementOutcome::exact_prior) {
    baselines_.clear();
    return;
  }
  depth::AlignedMotion aligned = align(pair, newest);
  std::optional<depth::BaselineWindow::Seen> seen = length_seen(aligned, update_.step);
  if (seen &&
      baselines_.surprise(given, aligned.motion.t_reference_other.normalized(), *seen) > kLengthGate) {
    aligned = {pair.motion};  // neither GPS/INS nor the steps before agree: the images were laid over wrongly
    seen.reset();
  }
  RelativeMotion motion = aligned.motion;
  const double length = motion.t_reference_other.norm();
  if (!(length > 0)) {
    baselines_.clear();
    return;
  }
  const Eigen::Vector3d direction = motion.t_reference_other / length;
  Eigen::Matrix3d covariance = motion.covariance.topLeftCorner<3, 3>();
  const double along = direction.dot(covariance * direction);
  const std::vector<double> factors = baselines_.push(given, direction, seen);
  const double longer = recent_.stretch(factors, update_.step, baselines_.variance());
  if (!found_.empty()) found_.rho *= 1 / longer;
  motion.t_reference_other = baselines_.length() * direction;
  covariance += (baselines_.variance() * motion.t_reference_other.squaredNorm() - along) * direction *
                direction.transpose();
  motion.covariance.topLeftCorner<3, 3>() = covariance;
  update_.aligned = aligned.aligned;
  if (aligned.aligned) refinement.outcome = RefinementOutcome::refined;
  if (refinement.outcome != RefinementOutcome::refined) return;
  refinement.motion = pair.motion = motion;
  depth::state_length_and_direction(refinement);
}

/// Hangs the newest frame on the older one by the refined motion.
void ObstacleMapper::place(TrackedFrame& newest, const TrackedFrame& older) const {
  const bool refined = update_.refinement.outcome == depth::RefinementOutcome::refined;
  newest.corrected = refined || older.corrected;
  if (!newest.corrected) return;
  const RelativeMotion& motion = update_.refinement.motion;
  const Pose T_reference_other{Eigen::Quaterniond(motion.R_reference_other).normalized(),
                               motion.t_reference_other};
  newest.frame.T_world_camera =
      older.frame.T_world_camera *
      (options_.order == Order::newest ? T_reference_other.inverse() : T_reference_other);
  if (options_.step > 1) {
    // Each of so many chains of frames would go its own way: the poses as given tie them to each other.
    const TrackedFrame& last = recent_.last();
    newest.frame.T_world_camera = interpolate(
        newest.frame.T_world_camera, last.frame.T_world_camera * (last.given.inverse() * newest.given), kTie);
  }
  newest.frame.T_world_camera.rotation.normalize();
}

}  // namespace pade
