// What a GNSS receiver measures of each satellite, and what the satellites say of themselves: plain values.
// All times are GPS time, counted from 1980-01-06 00:00:00; all positions are ECEF (WGS84), metres.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/sensors/odometry.hpp"
#include "pade/core/time.hpp"

namespace pade::gnss {

constexpr double kSpeedOfLight = 299792458.0;  ///< m/s

/// The constellations whose satellites are used. Others (SBAS, QZSS, NavIC) are passed over by the readers.
enum class System : std::uint8_t { gps, glonass, galileo, beidou };
constexpr std::size_t kSystems = 4;                                       ///< how many they are
constexpr std::array<char, kSystems> kSystemLetters{'G', 'R', 'E', 'C'};  ///< RINEX's, in their order

/// A satellite: RINEX's letter and number.
struct SatelliteId {
  System system = System::gps;
  std::uint8_t number = 0;  ///< 1 to 63
  /// By system, then number.
  auto operator<=>(const SatelliteId&) const = default;  // NOLINT(modernize-use-nullptr): as in time.hpp
};

/// "G08".
inline std::string to_string(SatelliteId id) {
  return {kSystemLetters.at(static_cast<std::size_t>(id.system)),
          static_cast<char>('0' + id.number / 10 % 10), static_cast<char>('0' + id.number % 10)};
}

/// One signal of one satellite at one epoch. What the receiver does not give is empty.
struct Signal {
  SatelliteId satellite;
  std::array<char, 2> code{'1', 'C'};  ///< RINEX's band and attribute
  std::optional<double> pseudorange;   ///< m
  std::optional<double> carrier;       ///< phase, cycles; grows with the distance
  std::optional<double> doppler;       ///< Hz, positive when the satellite approaches
  std::optional<double> cn0;           ///< carrier to noise density, dB-Hz
  bool lost_lock = false;              ///< since the epoch before: the phase may have slipped
  bool half_cycle = false;             ///< the phase may be off by half a cycle
};

/// All that was measured at one moment of the receiver's clock.
struct Epoch {
  Time time;                    ///< GPS time by the receiver's clock
  std::vector<Signal> signals;  ///< each satellite and code once
};

/// The carrier's frequency in Hz by RINEX's band, 0 if the system has no such band.
/// @param channel  GLONASS's frequency number, -7 to 6; of no account otherwise
inline double carrier_frequency(System system, char band, int channel) {
  using Table = std::array<std::pair<char, double>, 6>;
  static constexpr std::array<Table, kSystems> kTables{{
      {{{'1', 1575.42e6}, {'2', 1227.6e6}, {'5', 1176.45e6}}},
      {{{'1', 1602e6}, {'2', 1246e6}, {'3', 1202.025e6}}},
      {{{'1', 1575.42e6}, {'5', 1176.45e6}, {'6', 1278.75e6}, {'7', 1207.14e6}, {'8', 1191.795e6}}},
      {{{'1', 1575.42e6},
        {'2', 1561.098e6},
        {'5', 1176.45e6},
        {'6', 1268.52e6},
        {'7', 1207.14e6},
        {'8', 1191.795e6}}},
  }};
  for (const auto& [name, frequency] : kTables.at(static_cast<std::size_t>(system))) {
    if (name != band || frequency == 0) continue;
    if (system != System::glonass || band == '3') return frequency;
    return frequency + channel * (band == '1' ? 562.5e3 : 437.5e3);
  }
  return 0;
}

/// Broadcast orbit and clock of a GPS, Galileo or BeiDou satellite, in the words of IS-GPS-200.
struct KeplerEphemeris {
  SatelliteId satellite;
  Time toc;                                   ///< of the clock's polynomial
  Time toe;                                   ///< of the orbit
  double toe_of_week = 0;                     ///< the same in the system's own time, s of its week
  double af0 = 0, af1 = 0, af2 = 0;           ///< s, s/s, s/s²
  double sqrt_a = 0;                          ///< sqrt(m)
  double eccentricity = 0;                    ///< 0 to below 1
  double m0 = 0, delta_n = 0;                 ///< mean anomaly rad, its rate's correction rad/s
  double omega0 = 0, omega_dot = 0;           ///< node rad, rad/s
  double i0 = 0, idot = 0;                    ///< inclination rad, rad/s
  double omega = 0;                           ///< argument of the perigee, rad
  double cuc = 0, cus = 0, cic = 0, cis = 0;  ///< rad
  double crc = 0, crs = 0;                    ///< m
  double group_delay = 0;                     ///< of the first band (TGD, BGD E5b/E1, TGD1), s
  double accuracy = 0;                        ///< of orbit and clock as broadcast, m; 0 if not said
  int health = 0;                             ///< 0 is healthy
  bool second_choice = false;  ///< Galileo's F/NAV, whose clock is of other signals than E1's users see
};

/// Broadcast state of a GLONASS satellite.
struct GlonassEphemeris {
  SatelliteId satellite;
  Time toe;                                                ///< in GPS time
  double clock = 0;                                        ///< -τ_n, s
  double clock_rate = 0;                                   ///< γ_n
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< PZ-90, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< of Moon and Sun, m/s²
  int channel = 0;                                         ///< frequency number
  int health = 0;                                          ///< 0 is healthy
};

/// Klobuchar's eight numbers, as GPS broadcasts them.
struct IonosphereModel {
  std::array<double, 4> alpha{};  ///< s, s per semicircle, ...
  std::array<double, 4> beta{};   ///< s, s per semicircle, ...
};

/// What was received of the satellites' own messages, in any order.
struct BroadcastData {
  std::vector<KeplerEphemeris> kepler;
  std::vector<GlonassEphemeris> glonass;
  std::optional<IonosphereModel> ionosphere;
};

/// A pseudorange whose satellite's place is known and that is corrected for all but the receiver's clock.
struct KnownRange {
  SatelliteId satellite;
  Eigen::Vector3d position =
      Eigen::Vector3d::Zero();  ///< of the satellite when it sent, in ECEF of that moment
  double range = 0;             ///< m
  double sigma = 1;             ///< m
  std::optional<double> cn0;    ///< dB-Hz
};

/// All known ranges of one moment.
struct KnownRangeEpoch {
  Time time;
  std::vector<KnownRange> ranges;
};

/// A position that is known from elsewhere.
struct TruePosition {
  Time time;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// A recording of raw GNSS. Epochs are in the order of their times, each time once.
struct RawLog {
  std::vector<Epoch> epochs;
  BroadcastData broadcast;
  std::vector<KnownRangeEpoch>
      known_ranges;                      ///< of recordings that have no ephemerides but satellites' places
  std::vector<PlanarOdometry> odometry;  ///< beside them, in the order of its times; empty if there is none
  std::vector<TruePosition> truth;       ///< empty if there is none
  std::vector<std::string> remarks;      ///< what was left out, and where: one sentence each
};

}  // namespace pade::gnss
