// Is a recording sane before hours are spent on it: gaps in time, motion between frames and the parallax that
// it gives, the convention of its poses, and which way is up.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pade/checks/pose_check.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::evaluation {

/// Smallest, middle and largest of some values.
struct Spread {
  double least = 0, median = 0, most = 0;
};

/// What a sequence is like. Figures "per step" are between a frame and the step-th before it.
struct SequenceCheck {
  int step = 1;
  double duration = 0;                   ///< seconds from the first to the last frame
  Spread gap;                            ///< seconds between neighbouring frames
  Spread baseline;                       ///< metres per step
  Spread rotation;                       ///< radians per step
  double forward_share = 0;              ///< of the baseline along the optical axis, 0 sideways to 1
  double parallax_at_5_metres = 0;       ///< pixels per step, median over frames and image
  std::optional<double> parallax;        ///< pixels per step from true depth, median
  std::optional<double> truth_coverage;  ///< share of pixels with true depth
  std::optional<Spread> truth_depth;     ///< metres; 1 %, 50 % and 99 % of the pixels
  std::optional<double>
      up_disagreement;  ///< radians between the stated up axis and the cameras' mean up axis
  PoseCheck poses;
  std::vector<std::string> warnings;  ///< what a user should act on, one sentence each
};

/// Looks at `pairs` pairs of frames spread over the sequence (poses and times at all of them). Frames that
/// cannot be decoded are passed over; an error only if none of them can.
Result<SequenceCheck> check_sequence(const io::Sequence& sequence, int step = 1, int pairs = 14);

}  // namespace pade::evaluation
