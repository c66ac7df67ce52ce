// How far a camera turns from image to image, by the images alone (docs/calibration.md).
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/time.hpp"
#include "pade/depth/motion/motion_refinement.hpp"
#include "pade/flow/flow_estimator.hpp"

namespace pade {

/// Turn of a camera between two of its images.
struct ImageTurn {
  Time from;  ///< stamp of the older image
  Time to;    ///< of the newer one
  Eigen::Quaterniond R_from_to =
      Eigen::Quaterniond::Identity();  ///< directions of the newer camera in the older
  /// Of θ in R_from_to exp(θ): axes of the newer camera, rad².
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// What became of the pairs of images.
struct TurnTally {
  std::size_t pairs = 0;         ///< looked at
  std::size_t moving = 0;        ///< gave a turn, beside a direction of motion
  std::size_t still = 0;         ///< gave a turn; there was no parallax to speak of
  std::size_t blank = 0;         ///< gave none: too few pixels that tell one
  std::size_t contradicted = 0;  ///< gave none: they fit no single motion
};

/// Measures turns between images that come one after the other. Nothing of the motion has to be known: the
/// search begins at the turn before, tries directions all around, and leaves the rest to MotionRefiner. A
/// scene in one plane has a second solution, a degree from the first, that only an expected turn tells apart.
/// Images wider than 800 px are halved before. One per thread.
class TurnMeter {
 public:
  /// @param camera  undistorted pinhole of all images. @param valid  CV_8UC1 of its size, 0 where no image
  /// sees anything; empty = all valid
  TurnMeter(const Camera& camera, const cv::Mat& valid);

  /// The turn from the image before. Nothing for the first, or where the pair tells none.
  /// @param grey  CV_8UC1 of the camera's size
  /// @param expected  R_from_to to within some tenths of a degree, if it is known
  std::optional<ImageTurn> add(const cv::Mat& grey, Time stamp,
                               const std::optional<Eigen::Quaterniond>& expected = {});
  /// Images are missing here: the next one is a first one.
  void restart();

  [[nodiscard]] const TurnTally& tally() const { return tally_; }

 private:
  struct Fit;
  [[nodiscard]] Fit turn_alone(const Eigen::Matrix3d& R) const;
  [[nodiscard]] std::vector<Fit> directions(const Fit& start, bool known) const;
  void select(const FlowField& flow, const Eigen::Matrix3d& R_removed);

  Camera camera_;
  int halvings_ = 0;
  cv::Mat gate_;
  std::unique_ptr<flow::FlowEstimator> flow_;
  depth::MotionRefiner refiner_;
  std::vector<depth::MotionRefiner::Match> matches_;
  cv::Mat last_;
  Time last_stamp_;
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();  // of R_to_from, rad/s
  TurnTally tally_;
};

}  // namespace pade
