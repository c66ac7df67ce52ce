#include "pade/navigation/gnss/atmosphere.hpp"

#include <algorithm>
#include <cmath>

namespace pade::gnss {
namespace {

constexpr double kEquator = 6378137.0;             // WGS84's equator
constexpr double kFlattening = 1 / 298.257223563;  // WGS84's
constexpr double kSquaredEccentricity = kFlattening * (2 - kFlattening);
constexpr double kPi = M_PI;
constexpr double kAssumedIonosphere = 5;  // in the zenith, m: between a night's 1.5 m and a high sun's 15 m

/// What a delay is longer than in the zenith, by Klobuchar.
double ionosphere_slant(Direction direction) {
  return 1 + 16 * std::pow(0.53 - std::max(direction.elevation, 0.0) / kPi, 3);
}

}  // namespace

Geodetic geodetic_of(const Eigen::Vector3d& ecef) {
  const double across = ecef.head<2>().norm();
  Geodetic place;
  if (ecef.squaredNorm() < 1) return {0, 0, -kEquator};
  place.longitude = std::atan2(ecef.y(), ecef.x());
  // z is moved along the axis to where the normal meets it.
  double z = ecef.z();
  double normal = kEquator;
  for (int i = 0; i < 20; ++i) {
    const double sine = z / std::hypot(across, z);
    normal = kEquator / std::sqrt(1 - kSquaredEccentricity * sine * sine);
    const double next = ecef.z() + normal * kSquaredEccentricity * sine;
    const bool done = std::abs(next - z) < 1e-7;
    z = next;
    if (done) break;
  }
  place.latitude = std::atan2(z, across);
  place.height = std::hypot(across, z) - normal;
  return place;
}

Eigen::Vector3d ecef_of(const Geodetic& place) {
  const double sine = std::sin(place.latitude);
  const double normal = kEquator / std::sqrt(1 - kSquaredEccentricity * sine * sine);
  const double across = (normal + place.height) * std::cos(place.latitude);
  return {across * std::cos(place.longitude), across * std::sin(place.longitude),
          (normal * (1 - kSquaredEccentricity) + place.height) * sine};
}

Eigen::Matrix3d enu_axes(const Geodetic& place) {
  const double sl = std::sin(place.latitude), cl = std::cos(place.latitude);
  const double so = std::sin(place.longitude), co = std::cos(place.longitude);
  Eigen::Matrix3d axes;
  axes << -so, co, 0, -sl * co, -sl * so, cl, cl * co, cl * so, sl;
  return axes;
}

Direction direction_of(const Eigen::Vector3d& line_of_sight, const Eigen::Matrix3d& R_enu_ecef) {
  const Eigen::Vector3d enu = R_enu_ecef * line_of_sight;
  return {std::atan2(enu.x(), enu.y()), std::atan2(enu.z(), enu.head<2>().norm())};
}

double ionosphere_delay(const IonosphereModel& model, const Geodetic& place, Direction direction, Time time) {
  // In semicircles, as the document has it.
  const double elevation = std::max(direction.elevation, 0.0) / kPi;
  const double angle =
      0.0137 / (elevation + 0.11) - 0.022;  // between receiver and pierce point, at the centre
  const double latitude =
      std::clamp(place.latitude / kPi + angle * std::cos(direction.azimuth), -0.416, 0.416);
  const double longitude =
      place.longitude / kPi + angle * std::sin(direction.azimuth) / std::cos(latitude * kPi);
  const double magnetic = latitude + 0.064 * std::cos((longitude - 1.617) * kPi);
  double local = std::fmod(43200 * longitude + std::fmod(time.seconds(), 86400.0), 86400.0);
  if (local < 0) local += 86400;
  const auto series = [&](const std::array<double, 4>& c) {
    return c[0] + magnetic * (c[1] + magnetic * (c[2] + magnetic * c[3]));
  };
  const double amplitude = std::max(series(model.alpha), 0.0);
  const double period = std::max(series(model.beta), 72000.0);
  const double phase = 2 * kPi * (local - 50400) / period;
  const double slant = ionosphere_slant(direction);
  double seconds = 5e-9;
  if (std::abs(phase) < 1.57) {
    seconds += amplitude * (1 - phase * phase / 2 + phase * phase * phase * phase / 24);
  }
  return kSpeedOfLight * slant * seconds;
}

double assumed_ionosphere_delay(Direction direction) {
  return kAssumedIonosphere * ionosphere_slant(direction);
}

double troposphere_delay(const Geodetic& place, Direction direction) {
  if (direction.elevation <= 0) return 0;
  constexpr double kHumidity = 0.7;
  constexpr double kTropopause = 11000;  // m; above it the temperature is the same
  constexpr double kScaleHeight = 6342;  // of the pressure there, m
  const double height = std::clamp(place.height, -1000.0, 1e5);
  const double below = std::min(height, kTropopause);
  const double pressure =
      1013.25 * std::pow(1 - 2.2557e-5 * below, 5.2568) * std::exp((below - height) / kScaleHeight);  // hPa
  const double temperature = 15 - 6.5e-3 * below + 273.16;                                            // K
  const double vapour = 6.108 * kHumidity * std::exp((17.15 * temperature - 4684) / (temperature - 38.45));
  const double gravity = 1 - 0.00266 * std::cos(2 * place.latitude) - 0.00028 * height / 1e3;
  const double zenith = 0.0022768 * pressure / gravity + 0.002277 * (1255 / temperature + 0.05) * vapour;
  return zenith / std::sin(std::max(direction.elevation, 0.05));
}

}  // namespace pade::gnss
