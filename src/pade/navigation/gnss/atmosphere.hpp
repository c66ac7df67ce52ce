// Where on the Earth, and what the air delays.
#pragma once

#include <Eigen/Core>

#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::gnss {

/// A place on the WGS84 ellipsoid.
struct Geodetic {
  double latitude = 0;   ///< rad
  double longitude = 0;  ///< rad
  double height = 0;     ///< above the ellipsoid, m
};

/// From ECEF, to better than 1 µm within 50 km of the ground. The Earth's centre is on the equator.
Geodetic geodetic_of(const Eigen::Vector3d& ecef);

/// ECEF, m.
Eigen::Vector3d ecef_of(const Geodetic& place);

/// R_enu_ecef: east, north and up at a place, row by row.
Eigen::Matrix3d enu_axes(const Geodetic& place);

/// In which direction a satellite stands.
struct Direction {
  double azimuth = 0;    ///< from north to east, rad
  double elevation = 0;  ///< rad
};

/// @param line_of_sight  from the receiver to the satellite, ECEF, any length but 0
/// @param R_enu_ecef     enu_axes() of the receiver
Direction direction_of(const Eigen::Vector3d& line_of_sight, const Eigen::Matrix3d& R_enu_ecef);

/// Klobuchar's delay at 1575.42 MHz, m (IS-GPS-200 20.3.3.5.2.5); it goes with 1/f².
double ionosphere_delay(const IonosphereModel& model, const Geodetic& place, Direction direction, Time time);

/// What is assumed where no model was received: 5 m in the zenith, slanted as Klobuchar's. It may be wrong by
/// as much.
double assumed_ionosphere_delay(Direction direction);

/// Saastamoinen's delay in the standard atmosphere, m, humidity 70 %, both parts over the cosine of the
/// zenith angle. Without a step at any height: from 11 km on the air is as cold as there, and below -1 km and
/// above 100 km the delay is that of these heights. 0 below the horizon.
double troposphere_delay(const Geodetic& place, Direction direction);

}  // namespace pade::gnss
