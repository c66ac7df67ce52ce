// Where on another clock the turns of a camera fit those of a body, however it is mounted: over all offsets
// at which the two recordings overlap.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/offline/calibration/gyro_track.hpp"
#include "pade/offline/calibration/image_turns.hpp"

namespace pade {

/// An offset that may be right.
struct OffsetCandidate {
  double offset = 0;       ///< t_imu = t_image + offset, s
  double correlation = 0;  ///< of the turn rates under the rotation that fits best, 0 to 1
  double gain = 0;         ///< of log likelihood over no relation, for as many independent samples as overlap
  double overlap = 0;      ///< s
  /// Sum of (rate of camera)(rate of body)^T: its singular vectors are the mounting.
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
};

/// What the search went over.
struct OffsetSearch {
  std::vector<OffsetCandidate> candidates;  ///< peaks apart from each other, best first
  double from = 0;                          ///< offsets that were tried, s
  double to = 0;                            ///< the last of them
  double step = 0;                          ///< between two, s
};

/// Cross-correlates the rates at all offsets. At each the score is the sum of the singular values of
/// the 3x3 matrix of cross-correlations, the last with the sign of the determinant: what the best rotation
/// between the two reaches. Errors: recordings too long for their stamps to be right, none to compare.
/// @param turns  in order of time
/// @param least_overlap  at which an offset counts, s
Result<OffsetSearch> search_offsets(const std::vector<ImageTurn>& turns, const GyroTrack& gyro,
                                    double least_overlap, std::size_t most_candidates);

}  // namespace pade
