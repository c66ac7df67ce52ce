// Where a satellite is and what its clock shows, from its broadcast message.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::gnss {

constexpr double kEarthRate = 7.2921151467e-5;  ///< rad/s, of GPS's and Galileo's interface documents

/// A satellite at one moment, in ECEF of that moment.
struct SatelliteState {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< in the turning frame, m/s
  double clock = 0;                                    ///< ahead of GPS time, with relativity, s
  double clock_rate = 0;                               ///< its rate, s/s
};

/// By Kepler's elements with the corrections of IS-GPS-200 20.3.3.4.3 (Galileo OS SIS ICD 5.1.1, BeiDou B1I
/// ICD 5.2.4.12 with the turned frame of its geostationary satellites).
/// @param since_toe  GPS time less `toe`, s
SatelliteState satellite_state(const KeplerEphemeris& ephemeris, double since_toe);

/// By Runge-Kutta of fourth order in steps of at most 60 s, J2 and the given acceleration of Moon and Sun
/// (GLONASS ICD 5.1, A.3.1.2).
/// @param since_toe  GPS time less `toe`, s
SatelliteState satellite_state(const GlonassEphemeris& ephemeris, double since_toe);

/// Why a satellite cannot be used.
enum class NoState : std::uint8_t { no_ephemeris, stale, unhealthy };
/// "no ephemeris", "stale ephemeris", "unhealthy".
const char* to_name(NoState reason);

/// Which ephemeris of a satellite holds at a time. Both pointers are null if none does.
struct EphemerisChoice {
  const KeplerEphemeris* kepler = nullptr;
  const GlonassEphemeris* glonass = nullptr;
  NoState reason = NoState::no_ephemeris;                                               ///< if both are null
  [[nodiscard]] bool found() const { return kepler != nullptr || glonass != nullptr; }  ///< one is not null
};

/// The ephemeris whose toe is nearest to `time`: within 2 h for GPS, 4 h for Galileo, 6 h for BeiDou, 30 min
/// for GLONASS; of Galileo I/NAV before F/NAV. If the nearest is unhealthy there is none.
EphemerisChoice choose_ephemeris(const BroadcastData& broadcast, SatelliteId satellite, Time time);

/// When a signal left the satellite, and the satellite then.
/// @param received     by the receiver's clock
/// @param pseudorange  m
SatelliteState state_at_transmission(const EphemerisChoice& choice, Time received, double pseudorange);

}  // namespace pade::gnss
