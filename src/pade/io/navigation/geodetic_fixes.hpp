// Fixes of a receiver on the globe, as the navigation takes them: east, north, up of the first.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/core/time.hpp"

namespace pade::io {

/// What a receiver says at one moment.
struct GeodeticFix {
  Time time;                                       ///< of the measurement
  double latitude = 0;                             ///< degrees
  double longitude = 0;                            ///< degrees
  double height = 0;                               ///< m, above whatever the receiver counts from
  double horizontal = 0;                           ///< sigma, m; 0: not stated
  double vertical = 0;                             ///< sigma, m; 0: not stated
  std::optional<Eigen::Vector3d> velocity;         ///< east, north, up, m/s
  double velocity_sigma = 0;                       ///< m/s; 0: not stated
  bool climbs = true;                              ///< `velocity` has a vertical part
  std::optional<Eigen::Matrix3d> covariance = {};  ///< of the place, east north up, m²; instead of the sigmas
};

/// Local coordinates of all of them. Accuracies that are not stated are those of io::GnssDefaults, with a
/// remark, and each axis by itself; a vertical velocity that is not measured gets a sigma of 10 m/s: also
/// where it is exactly 0 in all of ten fixes and more.
/// @param fixes   at least one
/// @param source  message or topic, for the remarks
/// @param remarks  what had to be assumed is appended, one sentence each
GnssLog local_log(std::span<const GeodeticFix> fixes, const std::string& source,
                  std::vector<std::string>& remarks);

/// Of a vertical velocity that is not measured, m/s.
inline constexpr double open_vertical_velocity = 10;

/// Of the standard atmosphere, up to 11 km: the height above sea level, m, where the pressure is so many hPa.
double height_of_pressure(double hectopascal);
/// The other way round, hPa.
double pressure_at_height(double metres);

}  // namespace pade::io
