// What all satellites of an epoch have in common: the middle of their residuals, and jumps of the clock.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "pade/navigation/tight/raw_epoch.hpp"
#include "pade/navigation/tight/raw_state.hpp"

namespace pade::navigation {

/// Finite values whose middle one is asked for.
class Median {
 public:
  void add(double value) {
    if (count_ < values_.size() && std::isfinite(value)) values_.at(count_++) = value;
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double value() {
    if (count_ == 0) return 0;
    const auto middle = values_.begin() + static_cast<std::ptrdiff_t>(count_ / 2);
    std::nth_element(values_.begin(), middle, values_.begin() + static_cast<std::ptrdiff_t>(count_));
    return *middle;
  }

 private:
  std::array<double, kMostSatellites> values_{};
  std::size_t count_ = 0;
};

/// Those of an epoch that are used.
inline std::span<const RawSatellite> satellites_of(const RawEpoch& epoch) {
  return std::span(epoch.satellites).first(std::min(epoch.satellites.size(), kMostSatellites));
}

/// Whole milliseconds that all values have in common, by which clocks jump, m; 0 if they have not.
inline double jump_of(Median& residuals) {
  constexpr double kJump = 1e-3 * gnss::kSpeedOfLight;
  return std::round(residuals.value() / kJump) * kJump;
}

}  // namespace pade::navigation
