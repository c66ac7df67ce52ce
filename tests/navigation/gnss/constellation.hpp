// A sky of made-up satellites, and what a receiver measures of them by a model of its own: light that travels
// in the frame that does not turn, found by iteration.
#pragma once

#include <cmath>
#include <functional>

#include <Eigen/Geometry>

#include "pade/navigation/gnss/raw_run.hpp"

namespace pade::gnss {

constexpr std::int64_t kSecondInNanoseconds = 1'000'000'000;

/// Wednesday noon of GPS week 2268.
inline Time noon() { return {(2268LL * 604800 + 3 * 86400 + 43200) * kSecondInNanoseconds}; }

inline Time later(Time time, double seconds) {
  return {time.nanoseconds + static_cast<std::int64_t>(std::llround(seconds * 1e9))};
}

/// An eccentric, perturbed orbit that passes for one of its system.
inline KeplerEphemeris orbit(SatelliteId id, double node, double anomaly) {
  KeplerEphemeris e;
  e.satellite = id;
  e.toc = e.toe = noon();
  e.toe_of_week = 3 * 86400 + 43200 - (id.system == System::beidou ? 14 : 0);
  e.af0 = 1e-4, e.af1 = 3e-12, e.af2 = 1e-19;
  e.sqrt_a = id.system == System::gps ? 5153.7 : id.system == System::galileo ? 5440.6 : 5282.6;
  e.eccentricity = 0.012;
  e.m0 = anomaly, e.delta_n = 4e-9;
  e.omega0 = node, e.omega_dot = -8e-9;
  e.i0 = 0.96, e.idot = 2e-10, e.omega = 0.7;
  e.cuc = 2e-6, e.cus = 8e-6, e.cic = -9e-8, e.cis = 1e-7, e.crc = 230, e.crs = -40;
  e.group_delay = 4e-9;
  e.accuracy = 2;
  return e;
}

/// Forty satellites of three systems round the Earth.
inline BroadcastData sky() {
  BroadcastData data;
  data.ionosphere = IonosphereModel{{1.5e-8, 2.2e-8, -1.2e-7, -1.2e-7}, {1.1e5, 1.6e5, -6.6e4, -4.6e5}};
  std::uint8_t number = 10;
  for (const System system : {System::gps, System::galileo, System::beidou}) {
    for (int plane = 0; plane < 6; ++plane) {
      for (int slot = 0; slot < 4; ++slot) {
        data.kepler.push_back(
            orbit({system, number++}, plane * M_PI / 3, slot * M_PI / 2 + 0.4 * plane + number));
      }
    }
    number = 10;
  }
  return data;
}

/// How the receiver moves: its position at seconds of GPS time since noon.
using Path = std::function<Eigen::Vector3d(double)>;

struct Receiver {
  Path path;
  double clock = 3e-4;                                     ///< s at noon
  double clock_rate = 2e-8;                                ///< s/s
  std::array<double, kSystems> offset{0, 0, 5e-8, -2e-8};  ///< of each system's signals, s
};

/// What a signal says that arrives at `seconds` after noon of GPS time.
struct Arrival {
  double range;  ///< m, without clocks and air
  SatelliteState sent;
};

inline Arrival arrival(const KeplerEphemeris& e, const Path& path, double seconds) {
  const Eigen::Vector3d receiver = path(seconds);
  double travel = 0.07;
  Arrival a{0, {}};
  for (int i = 0; i < 10; ++i) {
    a.sent = satellite_state(e, seconds - travel);
    // What has turned while the light was under way.
    const Eigen::AngleAxisd turned(-kEarthRate * travel, Eigen::Vector3d::UnitZ());
    a.range = (turned * a.sent.position - receiver).norm();
    travel = a.range / kSpeedOfLight;
  }
  return a;
}

/// Range as the receiver sees it with clocks and air.
inline double measured(const KeplerEphemeris& e, const Receiver& receiver, const BroadcastData& data,
                       double seconds, bool phase) {
  const Arrival a = arrival(e, receiver.path, seconds);
  const Eigen::Vector3d at = receiver.path(seconds);
  const Geodetic place = geodetic_of(at);
  const Direction direction = direction_of(a.sent.position - at, enu_axes(place));
  const double clock = receiver.clock + receiver.clock_rate * seconds +
                       receiver.offset.at(static_cast<std::size_t>(e.satellite.system));
  const double frequency =
      carrier_frequency(e.satellite.system, e.satellite.system == System::beidou ? '2' : '1', 0);
  const double ionosphere =
      data.ionosphere ? std::pow(1575.42e6 / frequency, 2) *
                            ionosphere_delay(*data.ionosphere, place, direction, later(noon(), seconds))
                      : 0;
  return a.range + kSpeedOfLight * (clock - a.sent.clock) + troposphere_delay(place, direction) +
         (phase ? -ionosphere : ionosphere + kSpeedOfLight * e.group_delay);
}

/// All satellites above the horizon at `seconds` after noon of GPS time.
inline Epoch observe(const BroadcastData& data, const Receiver& receiver, double seconds) {
  Epoch epoch;
  epoch.time = later(noon(), seconds + receiver.clock + receiver.clock_rate * seconds);
  for (const KeplerEphemeris& e : data.kepler) {
    const Eigen::Vector3d at = receiver.path(seconds);
    const Arrival a = arrival(e, receiver.path, seconds);
    if (direction_of(a.sent.position - at, enu_axes(geodetic_of(at))).elevation < 0.05) continue;
    const bool beidou = e.satellite.system == System::beidou;
    const double wavelength = kSpeedOfLight / carrier_frequency(e.satellite.system, beidou ? '2' : '1', 0);
    Signal signal;
    signal.satellite = e.satellite;
    signal.code = {beidou ? '2' : '1', 'C'};
    signal.pseudorange = measured(e, receiver, data, seconds, false);
    signal.carrier = measured(e, receiver, data, seconds, true) / wavelength + 12345;
    constexpr double kStep = 0.05;
    signal.doppler = -(measured(e, receiver, data, seconds + kStep, true) -
                       measured(e, receiver, data, seconds - kStep, true)) /
                     (2 * kStep) / wavelength;
    signal.cn0 = 45;
    epoch.signals.push_back(signal);
  }
  return epoch;
}

/// Stuttgart, and a vehicle that flies a curve from there.
inline Eigen::Vector3d stuttgart() { return ecef_of({0.8514, 0.1601, 330}); }
inline Path curve() {
  return [](double t) -> Eigen::Vector3d {
    const Eigen::Matrix3d axes = enu_axes(geodetic_of(stuttgart()));
    return stuttgart() + axes.transpose() * Eigen::Vector3d(12 * t + 0.4 * t * t, 8 * std::sin(t), 2 * t);
  };
}

}  // namespace pade::gnss
