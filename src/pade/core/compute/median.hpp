// The middle of a list of numbers, and what robust estimates make of it.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <vector>

namespace pade {

/// Standard deviation of a normal distribution over the median of its absolute values.
inline constexpr double median_to_sigma = 1.4826;
/// Tukey's biweight forgets what lies more sigmas off; 95 % efficiency on normal noise.
inline constexpr double tukey_reach = 4.685;

/// The middle value, of an even number the upper one of the middle two; `none` where there is none. The
/// values come out in another order.
template <std::floating_point T>
T median(std::vector<T>& values, T none = std::numeric_limits<T>::quiet_NaN()) {
  if (values.empty()) return none;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
/// The same for values that nobody needs afterwards.
template <std::floating_point T>
T median(std::vector<T>&& values, T none = std::numeric_limits<T>::quiet_NaN()) {
  return median(values, none);
}

}  // namespace pade
