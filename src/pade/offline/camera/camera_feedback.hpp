// What the images of a sequence tell its navigation filter.
#pragma once

#include <cstdint>
#include <optional>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/navigation/navigation_run.hpp"
#include "pade/offline/camera/camera_odometer.hpp"

namespace pade {

/// The images of a sequence as NavigationRunOptions::camera wants them: one pair after the other.
class CameraFeedback {
 public:
  /// @param images  every image of the sequence, whatever its pose. @param log  of the same flight.
  /// @param offset  t_imu = t_image + offset, s. All must outlive this.
  CameraFeedback(const io::Sequence& images, const depth::MotionRefinementOptions& options,
                 const NavigationLog& log, const Pose& T_body_camera, double offset);

  /// What the images at two times show, if they can be read and show anything.
  std::optional<navigation::CameraMotion> operator()(Time t1, Time t2, const navigation::RelativePose& known);

  [[nodiscard]] const OdometerTally& tally() const { return odometer_.tally(); }
  [[nodiscard]] std::size_t unreadable() const { return unreadable_; }  ///< images

 private:
  [[nodiscard]] cv::Mat image_at(Time time);
  [[nodiscard]] std::optional<MotionGuess> guess_by_gyroscopes(Time t1, Time t2) const;

  const io::Sequence& images_;
  const NavigationLog& log_;
  Pose T_body_camera_;
  Time offset_;
  CameraOdometer odometer_;
  Time newest_time_{INT64_MIN};
  cv::Mat newest_;
  std::size_t next_ = 0;
  std::size_t unreadable_ = 0;
};

}  // namespace pade
