// How noisy a receiver's Doppler and phases are, as their residuals show it: receivers differ tenfold, and
// none says so.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "pade/navigation/gnss/positioning.hpp"

namespace pade::gnss {

/// By what a sigma is to be multiplied so that the residuals fit it, never less than 1: residuals that are
/// smaller than they may be prove little, as errors that all satellites have in common leave none.
class NoiseScale {
 public:
  /// @param chi_square  of residuals over the sigma that value() has scaled; `redundancy` is expected
  void add(double chi_square, int redundancy) {
    if (redundancy < 1 || !std::isfinite(chi_square)) return;
    const double freedom = redundancy;
    // One epoch that does not fit at all says no more than that.
    const double bounded = std::min(chi_square, kMostOfAnEpoch * freedom);
    const double scale = value();
    sum_ = std::min((sum_ + scale * scale * bounded), kLargest * kLargest * (weight_ + freedom));
    weight_ += freedom;
    if (weight_ <= kMemory) return;
    sum_ *= kMemory / weight_;
    weight_ = kMemory;
  }
  [[nodiscard]] double value() const { return std::sqrt(std::max(1.0, sum_ / weight_)); }

 private:
  static constexpr double kMemory = 600;  // equations: of 15 satellites some 50 epochs
  static constexpr double kMostOfAnEpoch = 16;
  static constexpr double kLargest = 100;

  double sum_ = 20;
  double weight_ = 20;  // as if so many had been as expected
};

/// Both scales of a receiver.
struct NoiseEstimate {
  NoiseScale rates, phases;

  /// The options with the sigmas that are found so far.
  [[nodiscard]] PositioningOptions applied_to(PositioningOptions options) const {
    if (options.estimate_doppler_sigma) options.doppler_sigma *= rates.value();
    if (options.estimate_phase_sigma) options.phase_sigma *= phases.value();
    return options;
  }
  void learn(const VelocityFix& velocity) { rates.add(velocity.chi_square, velocity.redundancy); }
  void learn(const PhaseStep& step) { phases.add(step.chi_square, step.redundancy); }
};

/// A sentence for each sigma that had to be enlarged by half or more.
std::vector<std::string> remarks_on(const NoiseEstimate& noise, const PositioningOptions& options);

}  // namespace pade::gnss
