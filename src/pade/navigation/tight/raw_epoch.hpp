// An epoch of raw GNSS as the filter takes it: each satellite's place in the local frame, and what was
// measured of it without all that is known of satellite and air.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "pade/core/lie.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::navigation {

/// One satellite at one epoch, in one signal. World frame: local ENU of the moment of reception, so turned by
/// what the Earth turns while the signal travels.
struct RawSatellite {
  gnss::SatelliteId satellite;
  std::array<char, 2> code{'1', 'C'};    ///< RINEX's band and attribute of the signal
  Vector3d position = Vector3d::Zero();  ///< when the signal left it, m
  Vector3d velocity = Vector3d::Zero();  ///< by which the distance to a place at rest changes, m/s
  std::optional<double> range;           ///< distance and the receiver's clock, m
  std::optional<double> rate;            ///< change of the distance and drift of the clock, m/s
  std::optional<double> phase;           ///< as `range`, less a constant of the satellite, m
  double range_sigma = 1;                ///< m
  double rate_sigma = 0.05;              ///< m/s
  double phase_sigma = 0.002;            ///< m
  bool lost_lock = false;                ///< the phase may not go on from the epoch before
  bool half_cycle = false;               ///< the phase may be off by half a cycle
};

/// All satellites at one moment.
struct RawEpoch {
  Time time;                             ///< by the receiver's clock, on the time scale of the IMU
  std::vector<RawSatellite> satellites;  ///< each once; those behind the 40th are not used
  std::optional<GnssFix> fix;            ///< of this epoch alone, for the start of the filter
  std::optional<GnssVelocity> velocity;  ///< from Doppler alone, for the start and as a check
};

}  // namespace pade::navigation
