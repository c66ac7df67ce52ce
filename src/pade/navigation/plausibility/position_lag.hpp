// Whether the positions of a GNSS and its velocities are of one flight: how late the ones are against the
// others, and whether they part.
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

/// How far positions and integrated velocities part, along the axis on which they part most.
struct PositionDrift {
  int axis = 0;        ///< 0 east, 1 north, 2 up
  double metres = 0;   ///< largest, of what the velocities fly beyond the positions
  double seconds = 0;  ///< until then, without a gap in the velocities
};

/// Where they part by more than 10 m and five sigmas of a fix: velocities with a bias of some cm/s or more,
/// which the gate of no single one shows. Empty where they do not, or the log cannot tell.
/// @param lag  of the positions against the velocities, s (PositionLag)
std::optional<PositionDrift> position_drift(const GnssLog& gnss, double lag);

}  // namespace pade::navigation
