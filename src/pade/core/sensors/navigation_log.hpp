// A recording of navigation sensors in the project's frames: body FLU, world local ENU.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/sensors/measurements.hpp"
#include "pade/core/time.hpp"

namespace pade {

/// Where the origin of the local ENU frame lies on the WGS84 ellipsoid.
struct GeodeticOrigin {
  double latitude = 0;   ///< degrees
  double longitude = 0;  ///< degrees
  double height = 0;     ///< m above the ellipsoid (or the source's own datum)
};

/// The true state of the body at one moment.
struct TrueState {
  Time time;
  Pose T_world_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< ENU, m/s
};

struct GnssLog {
  std::vector<GnssFix> fixes;
  std::vector<GnssVelocity> velocities;
  std::optional<GeodeticOrigin> origin;
  std::optional<Eigen::Vector3d> lever_arm;  ///< antenna in the body frame (FLU), if the file says so
};

/// What a log folder holds. Rows are in the order of the files: stamps may repeat or go back.
struct NavigationLog {
  std::vector<ImuSample> imu;
  GnssLog gnss;
  std::vector<BarometricHeight> barometer;
  std::vector<MagneticField> magnetometer;
  std::vector<TrueState> truth;      ///< empty if there is none
  std::vector<std::string> remarks;  ///< rows left out, values filled in: one sentence each
};

}  // namespace pade
