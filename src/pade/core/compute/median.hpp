// The middle of a list of numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace pade {

/// The middle value, of an even number the upper one of the middle two; `none` where there is none. The
/// values come out in another order.
inline double median(std::vector<double>& values, double none = std::numeric_limits<double>::quiet_NaN()) {
  if (values.empty()) return none;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
/// The same for values that nobody needs afterwards.
inline double median(std::vector<double>&& values, double none = std::numeric_limits<double>::quiet_NaN()) {
  return median(values, none);
}

}  // namespace pade
