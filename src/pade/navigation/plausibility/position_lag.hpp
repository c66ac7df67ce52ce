// How late the positions of a GNSS are against its velocities.
#pragma once

#include <optional>

#include "pade/core/sensors/navigation_log.hpp"

namespace pade::navigation {

struct PositionLag {
  double seconds = 0;  ///< positive = the positions are late
  double sigma = 0;    ///< of that, s
  double as_stamped =
      0;             ///< root mean square of what the way between two fixes and the velocities differ by, m
  double moved = 0;  ///< the same with the positions moved by the lag, m
};

/// The lag at which the ways between fixes fit the integrated velocities best, where it fits better than none
/// beyond doubt: by five sigmas of what is left over, and by at least 0.05 s. A lag of up to 3 s shows as far
/// as the vehicle turns or changes its speed; a flight straight on hides it. Empty where there is none or the
/// log cannot tell.
std::optional<PositionLag> position_lag(const GnssLog& gnss);

}  // namespace pade::navigation
