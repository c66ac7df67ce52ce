#include "pade/offline/camera/camera_feedback.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace pade {
namespace {

constexpr double kKnownDirection = 0.35;  // rad: the refinement starts from the filter's direction
constexpr double kGyroscopeBias = 0.03;   // of gyroscopes before the filter has started, rad/s
constexpr double kLeastSpeed = 0.5;       // m/s: below it there is no direction to look for
constexpr double kLatestVelocity = 1;     // s

/// Largest standard deviation of the direction of translation, rad.
double sigma_of_direction(const RelativeMotion& motion) {
  depth::RefinedMotion stated;
  stated.motion = motion;
  depth::state_length_and_direction(stated);
  return stated.direction_sigma;
}

Time later(Time time, Time by) { return Time{time.nanoseconds + by.nanoseconds}; }

}  // namespace

CameraFeedback::CameraFeedback(const io::Sequence& images, const depth::MotionRefinementOptions& options,
                               const NavigationLog& log, const Pose& T_body_camera, double offset)
    : images_(images),
      log_(log),
      T_body_camera_(T_body_camera),
      offset_(Time::from_seconds(offset)),
      odometer_(images.camera(), options, images.mask(), T_body_camera) {}

cv::Mat CameraFeedback::image_at(Time time) {
  while (next_ < images_.size() && images_.time(next_) < time) ++next_;
  if (next_ == images_.size() || images_.time(next_) != time) return {};
  const auto frame = images_.frame(next_);
  if (!frame) {
    ++unreadable_;
    return {};
  }
  cv::Mat grey;
  if (frame->image.channels() == 1) return frame->image.clone();
  cv::cvtColor(frame->image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// Before the filter has started: the rotation that the gyroscopes tell, the length that the GNSS tells.
std::optional<MotionGuess> CameraFeedback::guess_by_gyroscopes(Time t1, Time t2) const {
  const Time from = later(t1, offset_);
  const Time to = later(t2, offset_);
  const auto not_after = [](const auto& items, Time time) {
    return std::upper_bound(items.begin(), items.end(), time,
                            [](Time t, const auto& item) { return t < item.time; });
  };
  const auto after = not_after(log_.gnss.velocities, to);
  if (after == log_.gnss.velocities.begin()) return std::nullopt;
  const GnssVelocity& velocity = *(after - 1);
  const double speed = velocity.velocity.norm();
  if (!(speed > kLeastSpeed) || seconds_between(velocity.time, to) > kLatestVelocity) return std::nullopt;

  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();  // R_1_2 of the body
  Time time = from;
  for (auto sample = not_after(log_.imu, from); sample != log_.imu.end() && time < to; ++sample) {
    const Time end = std::min(sample->time, to);
    turned = turned * rotation_exp(Eigen::Vector3d(seconds_between(time, end) * sample->angular_rate));
    time = end;
  }
  if (time < to) return std::nullopt;
  MotionGuess guess;
  guess.has_direction = false;
  const double duration = seconds_between(from, to);
  guess.motion.R_reference_other =
      (T_body_camera_.rotation.conjugate() * turned.conjugate() * T_body_camera_.rotation).toRotationMatrix();
  guess.motion.t_reference_other = {0, 0, -speed * duration};
  guess.motion.duration = -duration;
  const double sigma = kGyroscopeBias * duration;
  guess.motion.covariance.bottomRightCorner<3, 3>() = sigma * sigma * Eigen::Matrix3d::Identity();
  return guess;
}

std::optional<navigation::CameraMotion> CameraFeedback::operator()(Time t1, Time t2,
                                                                   const navigation::RelativePose& known) {
  const cv::Mat older = newest_time_ == t1 ? newest_ : image_at(t1);
  newest_ = image_at(t2);
  newest_time_ = t2;
  if (older.empty() || newest_.empty()) return std::nullopt;
  if (known.answer == navigation::Answer::valid) {
    const RelativeMotion prior = reversed(known.motion);
    if (sigma_of_direction(prior) < kKnownDirection)
      return odometer_.measure(older, t1, newest_, t2, {prior, true});
  }
  const auto guess = guess_by_gyroscopes(t1, t2);
  return guess ? odometer_.measure(older, t1, newest_, t2, *guess) : std::nullopt;
}

}  // namespace pade
