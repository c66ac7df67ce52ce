#include "pade/io/navigation/geodetic_fixes.hpp"

#include <cmath>

#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/io/navigation/navigation_log.hpp"

namespace pade::io {
namespace {

constexpr double kVerticalVelocity = 10;  // sigma of one that is not measured, m/s

/// Counts how often a sigma had to be made up.
struct Filler {
  std::size_t filled = 0;
  double operator()(double stated, double otherwise) {
    if (stated > 0 && std::isfinite(stated)) return stated;
    ++filled;
    return otherwise;
  }
};

}  // namespace

double height_of_pressure(double hectopascal) {
  return 44330.77 * (1 - std::pow(hectopascal / 1013.25, 0.1902632));
}

double pressure_at_height(double metres) { return 1013.25 * std::pow(1 - metres / 44330.77, 1 / 0.1902632); }

GnssLog local_log(std::span<const GeodeticFix> fixes, const std::string& source,
                  std::vector<std::string>& remarks) {
  const GnssDefaults defaults;
  const GeodeticFix& first = fixes.front();
  GnssLog log;
  log.origin = GeodeticOrigin{first.latitude, first.longitude, first.height};
  const GeographicLib::LocalCartesian frame(first.latitude, first.longitude, first.height);
  Filler positions, heights, velocities, climbs;
  bool level = false;
  for (const GeodeticFix& fix : fixes) {
    Eigen::Vector3d place;
    frame.Forward(fix.latitude, fix.longitude, fix.height, place.x(), place.y(), place.z());
    const double across = positions(fix.horizontal, defaults.position_horizontal);
    const double up = heights(fix.vertical, defaults.position_vertical);
    log.fixes.push_back(
        {fix.time, place, Eigen::Vector3d(across * across, across * across, up * up).asDiagonal()});
    if (!fix.velocity) continue;
    const double speed = velocities(fix.velocity_sigma, defaults.velocity_horizontal);
    double climb = climbs(fix.velocity_sigma, defaults.velocity_vertical);
    if (!fix.climbs) climb = kVerticalVelocity;
    level = level || !fix.climbs;
    log.velocities.push_back(
        {fix.time, *fix.velocity, Eigen::Vector3d(speed * speed, speed * speed, climb * climb).asDiagonal()});
  }
  if (positions.filled > 0) {
    remarks.push_back(fmt::format("{}: {} of {} positions state no accuracy: {} m and {} m vertically",
                                  source, positions.filled, log.fixes.size(), defaults.position_horizontal,
                                  defaults.position_vertical));
  }
  if (velocities.filled > 0) {
    remarks.push_back(fmt::format("{}: {} of {} velocities state no accuracy: {} m/s", source,
                                  velocities.filled, log.velocities.size(), defaults.velocity_horizontal));
  }
  if (level) remarks.push_back(fmt::format("{}: has no vertical velocity, which is left open", source));
  return log;
}

}  // namespace pade::io
