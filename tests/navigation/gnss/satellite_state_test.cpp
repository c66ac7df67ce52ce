// Orbits and clocks against what mechanics demands of them.
#include <gtest/gtest.h>

#include "constellation.hpp"

namespace pade::gnss {
namespace {

using Eigen::Vector3d;

/// In the frame that does not turn, and that stands on the ECEF axes at toe.
Vector3d inertial(const Vector3d& ecef, double since_toe, double rate) {
  return Eigen::AngleAxisd(rate * since_toe, Vector3d::UnitZ()) * ecef;
}

KeplerEphemeris plain(System system) {
  KeplerEphemeris e = orbit({system, 11}, 0.3, 0.8);
  e.delta_n = e.omega_dot = e.idot = 0;
  e.cuc = e.cus = e.cic = e.cis = e.crc = e.crs = 0;
  return e;
}

TEST(KeplerOrbit, WithoutPerturbationsIsAClosedEllipse) {
  for (const System system : {System::gps, System::galileo, System::beidou}) {
    const KeplerEphemeris e = plain(system);
    const double gravitation = system == System::gps ? 3.9860050e14 : 3.986004418e14;
    const double rate = system == System::beidou ? 7.292115e-5 : kEarthRate;
    const double a = e.sqrt_a * e.sqrt_a;
    const double period = 2 * M_PI * std::sqrt(a * a * a / gravitation);
    const Vector3d start = satellite_state(e, 0).position;
    EXPECT_LT((inertial(satellite_state(e, period).position, period, rate) - start).norm(), 1e-4);
    for (double t = -7000; t < 7000; t += 500) {
      const SatelliteState s = satellite_state(e, t);
      const Vector3d r = inertial(s.position, t, rate);
      const Vector3d v = inertial(s.velocity + rate * Vector3d::UnitZ().cross(s.position), t, rate);
      // Energy, and the angular momentum's size.
      EXPECT_NEAR(v.squaredNorm() / 2 - gravitation / r.norm(), -gravitation / (2 * a), 1e-2);
      EXPECT_NEAR(r.cross(v).norm(), std::sqrt(gravitation * a * (1 - e.eccentricity * e.eccentricity)), 10);
      EXPECT_NEAR(r.cross(v).normalized().z(), std::cos(e.i0), 1e-12);
    }
  }
}

/// Central differences of positions and clocks.
template <class Ephemeris>
void expect_rates(const Ephemeris& e, double tolerance) {
  constexpr double kStep = 0.5;
  for (double t = -1700; t < 1700; t += 170) {
    const SatelliteState before = satellite_state(e, t - kStep);
    const SatelliteState after = satellite_state(e, t + kStep);
    const SatelliteState s = satellite_state(e, t);
    EXPECT_LT((s.velocity - (after.position - before.position) / (2 * kStep)).norm(), tolerance) << t;
    EXPECT_NEAR(s.clock_rate, (after.clock - before.clock) / (2 * kStep), 1e-15);
  }
}

TEST(KeplerOrbit, VelocityAndClockRateAreTheDerivatives) {
  expect_rates(orbit({System::gps, 11}, 0.3, 0.8), 1e-5);
  expect_rates(orbit({System::galileo, 11}, 2.3, -1.8), 1e-5);
  expect_rates(orbit({System::beidou, 11}, 1.3, 3), 1e-5);
  expect_rates(orbit({System::beidou, 3}, 1.3, 3), 1e-5);
}

TEST(KeplerOrbit, GeostationaryBeidouStandsStill) {
  KeplerEphemeris e = plain(System::beidou);
  e.satellite.number = 3;
  e.eccentricity = 0;
  e.sqrt_a = std::sqrt(std::cbrt(3.986004418e14 / (7.292115e-5 * 7.292115e-5)));
  e.i0 = 5 * M_PI / 180;  // undoes the tilt of the frame where the node is at 180°
  e.omega0 = M_PI + 7.292115e-5 * e.toe_of_week;
  const Vector3d start = satellite_state(e, 0).position;
  EXPECT_NEAR(start.norm(), 42164e3, 1e3);
  EXPECT_NEAR(start.z(), 0, 1);
  for (double t = -7000; t < 7000; t += 1000) {
    EXPECT_LT((satellite_state(e, t).position - start).norm(), 1);
    EXPECT_LT(satellite_state(e, t).velocity.norm(), 1e-3);
  }
}

GlonassEphemeris glonass() {
  GlonassEphemeris e;
  e.satellite = {System::glonass, 2};
  e.toe = noon();
  e.clock = -2e-5, e.clock_rate = 1e-12;
  e.position = {8.34273876953e6, 13.8681767578e6, 19.7839023438e6};
  e.velocity = {-2421.04339600, -1191.88594818, 1854.79354858};
  return e;
}

TEST(GlonassOrbit, KeepsTheJacobiIntegral) {
  // Without Moon and Sun what is left is a potential in a frame that turns evenly.
  const auto energy = [](const SatelliteState& s) {
    const double r = s.position.norm();
    const double sine = s.position.z() / r;
    const double potential =
        3.9860044e14 / r * (1 - 1.0826257e-3 * std::pow(6378136.0 / r, 2) * (3 * sine * sine - 1) / 2);
    return s.velocity.squaredNorm() / 2 - potential -
           std::pow(7.292115e-5, 2) * s.position.head<2>().squaredNorm() / 2;
  };
  const GlonassEphemeris e = glonass();
  for (const double t : {-1800.0, -900.0, 31.0, 900.0, 1800.0}) {
    EXPECT_NEAR(energy(satellite_state(e, t)), energy(satellite_state(e, 0)), 1e-3) << t;
  }
  expect_rates(e, 1e-3);
}

TEST(GlonassOrbit, ReturnsFromWhereItWent) {
  GlonassEphemeris e = glonass();
  e.acceleration = {9e-7, -1.8e-6, 9e-7};
  const SatelliteState there = satellite_state(e, 900);
  GlonassEphemeris from = e;
  from.position = there.position;
  from.velocity = there.velocity;
  EXPECT_LT((satellite_state(from, -900).position - e.position).norm(), 1e-3);
}

TEST(EphemerisChoice, SaysWhyThereIsNone) {
  BroadcastData data;
  const SatelliteId id{System::gps, 11};
  EXPECT_EQ(choose_ephemeris(data, id, noon()).reason, NoState::no_ephemeris);
  data.kepler.push_back(orbit(id, 0, 0));
  EXPECT_TRUE(choose_ephemeris(data, id, later(noon(), 7199)).found());
  EXPECT_EQ(choose_ephemeris(data, id, later(noon(), 7201)).reason, NoState::stale);
  data.kepler.push_back(data.kepler.front());
  data.kepler.back().toe = later(noon(), 7200);
  EXPECT_EQ(choose_ephemeris(data, id, later(noon(), 7201)).kepler, &data.kepler[1]);
  data.kepler.back().health = 63;
  EXPECT_EQ(choose_ephemeris(data, id, later(noon(), 7201)).reason, NoState::unhealthy);
  EXPECT_TRUE(choose_ephemeris(data, id, noon()).found());
}

TEST(EphemerisChoice, PrefersTheGalileoMessageOfItsFirstSignals) {
  BroadcastData data;
  const SatelliteId id{System::galileo, 11};
  data.kepler = {orbit(id, 0, 0), orbit(id, 0, 0)};
  data.kepler[0].second_choice = true;
  data.kepler[1].toe = later(noon(), -3000);
  EXPECT_EQ(choose_ephemeris(data, id, noon()).kepler, &data.kepler[1]);
  data.kepler[1].toe = later(noon(), -20000);
  EXPECT_EQ(choose_ephemeris(data, id, noon()).kepler, &data.kepler[0]);
}

}  // namespace
}  // namespace pade::gnss
