// Clocks that a test moves, so that it does not matter how long it takes.
#pragma once

#include "pade/live/dds/message_clock.hpp"

namespace pade::live {

inline constexpr Time kStillOurs{5'000'000'000'000}, kStillSystem{1'700'000'000'000'000'000};

/// Both stand at these times and what `moved` adds, which must outlive them.
inline TimeSources still_clocks(const std::int64_t& moved) {
  return {[&moved] { return Time{kStillOurs.nanoseconds + moved}; },
          [&moved] { return Time{kStillSystem.nanoseconds + moved}; }};
}

}  // namespace pade::live
