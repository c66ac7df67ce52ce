// A recording of raw GNSS, epoch by epoch: nothing is carried over but the last position as a guess and the
// last phases.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pade/navigation/gnss/noise_estimate.hpp"
#include "pade/navigation/gnss/positioning.hpp"

namespace pade::gnss {

/// What one epoch gave.
struct EpochResult {
  Time time;                              ///< by the receiver's clock
  std::optional<PositionFix> position;    ///< empty if too few satellites fit
  std::optional<VelocityFix> velocity;    ///< empty without position or Doppler
  std::optional<PhaseStep> step;          ///< since the epoch before; empty without phases that agree
  std::vector<SatelliteView> satellites;  ///< points into the log
};

/// All epochs of a recording.
struct RawRun {
  std::vector<EpochResult> epochs;
  std::array<std::size_t, kUses> uses{};  ///< of all satellites of all epochs, by Use
  std::size_t without_position = 0;       ///< epochs
  /// Epochs of the satellites that were measured and never in a signal that is used.
  std::map<SatelliteId, std::size_t> without_signal;
  NoiseEstimate noise;  ///< at the end
};

/// The satellites that were measured and could not be used, by reason: "no ephemeris: E31 (610 epochs)".
std::vector<std::string> unusable_satellites(const RawRun& run);

/// Plays a log that must outlive the result. The longest step is over kLongestStep; one whose phases
/// contradict each other is left out.
RawRun run_raw(const RawLog& log, const PositioningOptions& options);

}  // namespace pade::gnss
