// Clock and mounting of a camera on a body from the turns that both see (docs/calibration.md).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/result.hpp"
#include "pade/offline/calibration/gyro_track.hpp"
#include "pade/offline/calibration/image_turns.hpp"

namespace pade {

/// What turns tell of a camera on a body.
struct TurnAlignment {
  double offset = 0;        ///< t_imu = t_image + offset, in the middle of what was compared, s
  double offset_sigma = 0;  ///< standard deviation of it, s
  double drift = 0;         ///< by which the offset grows, s/s
  double drift_sigma = 0;   ///< of it; 1e-4 where the recording is too short to tell
  Time middle;              ///< of an image: there the offset is `offset`
  Time first;               ///< image that was compared
  Time last;                ///< the last of them
  Eigen::Quaterniond R_body_camera = Eigen::Quaterniond::Identity();
  /// Of φ in R_body_camera exp(φ): camera axes, rad². An axis that nothing turns about another than it
  /// keeps about 1.
  Eigen::Matrix3d mounting_covariance = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< body, rad/s: what fits best
  Eigen::Vector3d turn_rates = Eigen::Vector3d::Zero();  ///< of the body, root of mean square, rad/s
  std::size_t pairs = 0;                                 ///< of images, whose turns were compared
  std::size_t outliers = 0;                              ///< of them, hardly counted
  double residual = 0;          ///< of the turns, robust standard deviation per axis, rad
  double explained = 0;         ///< share of the turns' variance
  double correlation = 0;       ///< of the turn rates, 0 to 1
  double runner_up = 0;         ///< that of the next best offset; 0: there is none
  double runner_up_offset = 0;  ///< s
  double searched_from = 0;     ///< offsets, s
  double searched_to = 0;       ///< the last of them

  /// Standard deviation of the mounting's rotation about each axis of the body, rad.
  [[nodiscard]] Eigen::Vector3d mounting_sigma() const;
};

/// The turn of the camera between two images as a gyroscope has it under an alignment. Empty where it has
/// none.
std::optional<Eigen::Quaterniond> expected_turn(const TurnAlignment& alignment, const GyroTrack& gyro,
                                                Time from, Time to);

/// Refines an alignment that is nearly right with better turns. Errors: too few of them; the offset is hardly
/// known, or the turns contradict it.
Result<TurnAlignment> realign_turns(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                    const TurnAlignment& known);

/// Compares at every offset at which the two overlap by a third of the shorter (and 3 s), then refines
/// offset, drift, mounting and the gyroscope's bias together. Robust; the covariances are those of errors
/// that last over some pairs of images.
/// @param turns  in order of time. @param believed  mounting that axes take which no turn tells, if it is
/// known. Errors: too little overlap or rotation, no offset that fits, or two that fit alike.
Result<TurnAlignment> align_turns(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                  const std::optional<Eigen::Quaterniond>& believed = {});

}  // namespace pade
