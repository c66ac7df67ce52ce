// Motions between the images of a flight for the navigation filter (docs/navigation.md, section 9).
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/depth/motion/motion_refinement.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/navigation/camera/camera_motion.hpp"

namespace pade {

/// What is known of the motion between two images before they are looked at.
struct MotionGuess {
  /// Newest image as reference, with covariance. If `has_direction` is false, only the rotation and the
  /// length of the translation have a meaning.
  RelativeMotion motion;
  bool has_direction = true;
};

/// What became of pairs of images.
struct OdometerTally {
  std::size_t pairs = 0;     ///< that were looked at
  std::size_t measured = 0;  ///< that gave a motion
  std::size_t searched = 0;  ///< of them, those whose direction was looked for all around
  std::size_t still = 0;     ///< no motion, as there is no parallax to speak of
  std::size_t blank = 0;     ///< no motion, as there are too few pixels that tell one
  std::size_t refused = 0;  ///< no motion, as the images contradict what was known, or fit several directions
};

/// What a refined motion says without its prior; nothing if it was not refined.
std::optional<navigation::CameraMotion> camera_motion(const depth::RefinedMotion& refined, Time older,
                                                      Time newest, const Pose& T_body_camera);

/// Looks at pairs of images that come one after the other. One per thread.
class CameraOdometer {
 public:
  /// @param camera  undistorted pinhole of all images. @param valid  CV_8UC1 of its size, 0 where no frame
  /// sees anything; empty = all valid
  CameraOdometer(const Camera& camera, const depth::MotionRefinementOptions& options, const cv::Mat& valid,
                 const Pose& T_body_camera);

  /// The motion between two images as they alone show it.
  /// @param older, newest  CV_8UC1 of the camera's size
  std::optional<navigation::CameraMotion> measure(const cv::Mat& older, Time older_time,
                                                  const cv::Mat& newest, Time newest_time,
                                                  const MotionGuess& guess);

  [[nodiscard]] const OdometerTally& tally() const { return tally_; }

 private:
  [[nodiscard]] depth::RefinedMotion search(const depth::RefinementInput& input);

  Camera camera_;
  cv::Mat gate_;
  Pose T_body_camera_;
  std::unique_ptr<flow::FlowEstimator> flow_;
  depth::MotionRefiner refiner_;
  OdometerTally tally_;
};

}  // namespace pade
