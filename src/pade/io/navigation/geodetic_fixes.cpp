#include "pade/io/navigation/geodetic_fixes.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/io/navigation/navigation_log.hpp"

namespace pade::io {
namespace {

/// Counts how often a sigma had to be made up.
struct Filler {
  std::size_t filled = 0;
  double operator()(double stated, double otherwise) {
    if (stated > 0 && std::isfinite(stated)) return stated;
    ++filled;
    return otherwise;
  }
};

/// A covariance as it is stated where it is one; else its axes one by one.
Eigen::Matrix3d usable_covariance(const Eigen::Matrix3d& stated, Filler& positions, Filler& heights) {
  const GnssDefaults defaults;
  if (stated.allFinite() && stated.diagonal().minCoeff() > 0) {
    const Eigen::Matrix3d symmetric = 0.5 * (stated + stated.transpose());
    if (symmetric.llt().info() == Eigen::Success) return symmetric;
  }
  const double east = positions(std::sqrt(stated(0, 0)), defaults.position_horizontal);
  const double north = positions(std::sqrt(stated(1, 1)), defaults.position_horizontal);
  const double up = heights(std::sqrt(stated(2, 2)), defaults.position_vertical);
  return Eigen::Vector3d(east, north, up).cwiseAbs2().asDiagonal();
}

/// Whether all of many velocities have a vertical part of exactly 0, which no receiver measures.
bool are_level(std::span<const GeodeticFix> fixes) {
  constexpr std::ptrdiff_t kMany = 10;
  const auto moving = [](const GeodeticFix& fix) { return fix.velocity.has_value(); };
  return std::count_if(fixes.begin(), fixes.end(), moving) >= kMany &&
         std::all_of(fixes.begin(), fixes.end(),
                     [](const GeodeticFix& fix) { return !fix.velocity || fix.velocity->z() == 0; });
}

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
  std::size_t without = 0;
  const bool all_level = are_level(fixes);
  bool level = false;
  for (const GeodeticFix& fix : fixes) {
    Eigen::Vector3d place;
    frame.Forward(fix.latitude, fix.longitude, fix.height, place.x(), place.y(), place.z());
    const std::size_t unknown = positions.filled + heights.filled;
    Eigen::Matrix3d covariance;
    if (fix.covariance) {
      covariance = usable_covariance(*fix.covariance, positions, heights);
    } else {
      const double across = positions(fix.horizontal, defaults.position_horizontal);
      const double up = heights(fix.vertical, defaults.position_vertical);
      covariance = Eigen::Vector3d(across, across, up).cwiseAbs2().asDiagonal();
    }
    if (positions.filled + heights.filled > unknown) ++without;
    log.fixes.push_back({fix.time, place, covariance});
    if (!fix.velocity) continue;
    const double speed = velocities(fix.velocity_sigma, defaults.velocity_horizontal);
    double climb = climbs(fix.velocity_sigma, defaults.velocity_vertical);
    const bool open = !fix.climbs || all_level;
    if (open) climb = open_vertical_velocity;
    level = level || open;
    log.velocities.push_back(
        {fix.time, *fix.velocity, Eigen::Vector3d(speed * speed, speed * speed, climb * climb).asDiagonal()});
  }
  if (without > 0) {
    remarks.push_back(fmt::format("{}: {} of {} positions state no accuracy{}: {} m and {} m vertically",
                                  source, without, log.fixes.size(),
                                  positions.filled == 0 ? " of the height" : "", defaults.position_horizontal,
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
