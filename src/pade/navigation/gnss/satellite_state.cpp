#include "pade/navigation/gnss/satellite_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace pade::gnss {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Constants {
  double gravitation;  ///< m³/s²
  double earth_rate;   ///< rad/s
};

constexpr Constants constants_of(System system) {
  if (system == System::gps) return {3.9860050e14, kEarthRate};
  if (system == System::galileo) return {3.986004418e14, kEarthRate};
  return {3.986004418e14, 7.292115e-5};
}

/// BeiDou's geostationary satellites, whose elements are of a frame that is tilted by 5° about x.
bool is_geostationary(SatelliteId id) {
  return id.system == System::beidou && (id.number <= 5 || id.number >= 59);
}

double eccentric_anomaly(double mean, double eccentricity) {
  double e = mean;
  for (int i = 0; i < 30; ++i) {
    const double step = (e - eccentricity * std::sin(e) - mean) / (1 - eccentricity * std::cos(e));
    e -= step;
    if (std::abs(step) < 1e-14) break;
  }
  return e;
}

/// A value and its rate in time.
struct Rated {
  double value;
  double rate;
};

/// In the orbit's plane: distance, argument of latitude, inclination; and the eccentric anomaly.
struct InPlane {
  Rated anomaly, argument, radius, inclination;
};

InPlane in_plane(const KeplerEphemeris& p, double t, double gravitation) {
  const double a = p.sqrt_a * p.sqrt_a;
  const double n = std::sqrt(gravitation / (a * a * a)) + p.delta_n;
  const double e = eccentric_anomaly(p.m0 + n * t, p.eccentricity);
  const double shape = 1 - p.eccentricity * std::cos(e);
  const double e_rate = n / shape;
  const double root = std::sqrt(1 - p.eccentricity * p.eccentricity);
  const double latitude = std::atan2(root * std::sin(e), std::cos(e) - p.eccentricity) + p.omega;
  const double latitude_rate = root * e_rate / shape;
  const double s = std::sin(2 * latitude);
  const double c = std::cos(2 * latitude);
  const auto wave = [&](double sine, double cosine) {
    return Rated{sine * s + cosine * c, 2 * latitude_rate * (sine * c - cosine * s)};
  };
  const Rated u = wave(p.cus, p.cuc);
  const Rated r = wave(p.crs, p.crc);
  const Rated i = wave(p.cis, p.cic);
  return {{e, e_rate},
          {latitude + u.value, latitude_rate + u.rate},
          {a * shape + r.value, a * p.eccentricity * std::sin(e) * e_rate + r.rate},
          {p.i0 + p.idot * t + i.value, p.idot + i.rate}};
}

/// Position and velocity from the plane, whose node is at `node`.
void place(const InPlane& plane, const Rated& node, SatelliteState& state) {
  const double su = std::sin(plane.argument.value), cu = std::cos(plane.argument.value);
  const double si = std::sin(plane.inclination.value), ci = std::cos(plane.inclination.value);
  const double so = std::sin(node.value), co = std::cos(node.value);
  const double x = plane.radius.value * cu;
  const double y = plane.radius.value * su;
  const double vx = plane.radius.rate * cu - y * plane.argument.rate;
  const double vy = plane.radius.rate * su + x * plane.argument.rate;
  const double tilt = plane.inclination.rate;
  state.position = {x * co - y * ci * so, x * so + y * ci * co, y * si};
  const double ly = vy * ci - y * si * tilt;  // of y cos i
  state.velocity = {vx * co - ly * so - state.position.y() * node.rate,
                    vx * so + ly * co + state.position.x() * node.rate, vy * si + y * ci * tilt};
}

/// From the turned frame in which BeiDou gives its geostationary satellites, which does not rotate with the
/// Earth.
void turn_geostationary(double t, double earth_rate, SatelliteState& state) {
  const Eigen::AngleAxisd tilt(5 * M_PI / 180, Vector3d::UnitX());
  const Eigen::AngleAxisd turn(-earth_rate * t, Vector3d::UnitZ());
  const Vector3d position = turn * (tilt * state.position);
  const Vector3d velocity = turn * (tilt * state.velocity);
  state.position = position;
  state.velocity = velocity - earth_rate * Vector3d::UnitZ().cross(position);
}

using State6 = Eigen::Matrix<double, 6, 1>;

State6 glonass_rate(const State6& x, const Vector3d& acceleration) {
  constexpr double kGravitation = 3.9860044e14;
  constexpr double kJ2 = 1.0826257e-3;
  constexpr double kRate = 7.292115e-5;
  constexpr double kRadius = 6378136.0;
  const Vector3d r = x.head<3>();
  const double r2 = r.squaredNorm();
  const double r3 = r2 * std::sqrt(r2);
  const double oblate = 1.5 * kJ2 * kGravitation * kRadius * kRadius / (r2 * r3);
  const double polar = 5 * r.z() * r.z() / r2;
  const double central = -kGravitation / r3 - oblate * (1 - polar);
  State6 rate;
  rate.head<3>() = x.tail<3>();
  rate[3] = (central + kRate * kRate) * r.x() + 2 * kRate * x[4] + acceleration.x();
  rate[4] = (central + kRate * kRate) * r.y() - 2 * kRate * x[3] + acceleration.y();
  rate[5] = (central - 2 * oblate) * r.z() + acceleration.z();
  return rate;
}

double longest_age(System system) {
  switch (system) {
    case System::gps:
      return 7200;
    case System::galileo:
      return 14400;
    case System::beidou:
      return 21600;
    case System::glonass:
      return 1800;
  }
  return 0;
}

template <class Ephemeris>
const Ephemeris* nearest(const std::vector<Ephemeris>& all, SatelliteId satellite, Time time, auto penalty) {
  const Ephemeris* best = nullptr;
  double smallest = std::numeric_limits<double>::infinity();
  for (const Ephemeris& e : all) {
    if (e.satellite != satellite) continue;
    const double age = std::abs(seconds_between(e.toe, time)) + penalty(e);
    if (age < smallest) {
      smallest = age;
      best = &e;
    }
  }
  return best;
}

template <class Ephemeris>
EphemerisChoice judge(const Ephemeris* best, const Ephemeris* EphemerisChoice::*field, Time time) {
  EphemerisChoice choice;
  if (best == nullptr) return choice;
  if (std::abs(seconds_between(best->toe, time)) > longest_age(best->satellite.system)) {
    choice.reason = NoState::stale;
  } else if (best->health != 0) {
    choice.reason = NoState::unhealthy;
  } else {
    choice.*field = best;
  }
  return choice;
}

double clock_at(const KeplerEphemeris& e, double since_toe) { return satellite_state(e, since_toe).clock; }
double clock_at(const GlonassEphemeris& e, double since_toe) {
  return e.clock + e.clock_rate * since_toe;  // without the orbit, which takes long
}

template <class Ephemeris>
SatelliteState at_transmission(const Ephemeris& e, Time received, double pseudorange) {
  const double shown = seconds_between(e.toe, received) - pseudorange / kSpeedOfLight;
  // The satellite's own clock showed `shown`; it changes by 1e-9 s in the time that it is wrong by.
  return satellite_state(e, shown - clock_at(e, shown));
}

}  // namespace

SatelliteState satellite_state(const KeplerEphemeris& p, double since_toe) {
  const Constants earth = constants_of(p.satellite.system);
  const InPlane plane = in_plane(p, since_toe, earth.gravitation);
  SatelliteState state;
  const bool turned = is_geostationary(p.satellite);
  const double node_rate = p.omega_dot - (turned ? 0 : earth.earth_rate);
  place(plane, {p.omega0 + node_rate * since_toe - earth.earth_rate * p.toe_of_week, node_rate}, state);
  if (turned) turn_geostationary(since_toe, earth.earth_rate, state);
  const double t = since_toe + seconds_between(p.toc, p.toe);
  // Relativity: -2 sqrt(μ a) e sin E / c².
  const double relativity =
      -2 * std::sqrt(earth.gravitation) * p.sqrt_a * p.eccentricity / (kSpeedOfLight * kSpeedOfLight);
  state.clock = p.af0 + t * (p.af1 + t * p.af2) + relativity * std::sin(plane.anomaly.value);
  state.clock_rate = p.af1 + 2 * t * p.af2 + relativity * std::cos(plane.anomaly.value) * plane.anomaly.rate;
  return state;
}

SatelliteState satellite_state(const GlonassEphemeris& p, double since_toe) {
  constexpr double kStep = 60;
  State6 x;
  x << p.position, p.velocity;
  const int steps = static_cast<int>(std::min(std::ceil(std::abs(since_toe) / kStep), 1e4));
  const double h = steps > 0 ? since_toe / steps : 0;
  for (int i = 0; i < steps; ++i) {
    const State6 k1 = glonass_rate(x, p.acceleration);
    const State6 k2 = glonass_rate(x + 0.5 * h * k1, p.acceleration);
    const State6 k3 = glonass_rate(x + 0.5 * h * k2, p.acceleration);
    const State6 k4 = glonass_rate(x + h * k3, p.acceleration);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  SatelliteState state;
  state.position = x.head<3>();
  state.velocity = x.tail<3>();
  state.clock = p.clock + p.clock_rate * since_toe;
  state.clock_rate = p.clock_rate;
  return state;
}

const char* to_name(NoState reason) {
  switch (reason) {
    case NoState::no_ephemeris:
      return "no ephemeris";
    case NoState::stale:
      return "stale ephemeris";
    case NoState::unhealthy:
      return "unhealthy";
  }
  return "";
}

EphemerisChoice choose_ephemeris(const BroadcastData& broadcast, SatelliteId satellite, Time time) {
  if (satellite.system == System::glonass) {
    return judge(nearest(broadcast.glonass, satellite, time, [](const auto&) { return 0.0; }),
                 &EphemerisChoice::glonass, time);
  }
  return judge(
      nearest(broadcast.kepler, satellite, time,
              [](const KeplerEphemeris& e) { return e.second_choice ? longest_age(System::galileo) : 0.0; }),
      &EphemerisChoice::kepler, time);
}

SatelliteState state_at_transmission(const EphemerisChoice& choice, Time received, double pseudorange) {
  if (choice.kepler != nullptr) return at_transmission(*choice.kepler, received, pseudorange);
  if (choice.glonass != nullptr) return at_transmission(*choice.glonass, received, pseudorange);
  return {};
}

}  // namespace pade::gnss
