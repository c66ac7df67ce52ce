// What a count of successes says of the rate behind it.
#pragma once

#include <cstddef>

namespace pade::evaluation {

/// Both ends between 0 and 1.
struct RateInterval {
  double low = 0;
  double high = 1;
};

/// The exact interval of Clopper and Pearson (1934): the rates under which neither as few nor as many
/// successes have a probability below (1 - confidence) / 2.
/// @param successes  at most `trials`. @param trials  0 gives 0 to 1. @param confidence  between 0 and 1
RateInterval clopper_pearson(std::size_t successes, std::size_t trials, double confidence);

}  // namespace pade::evaluation
