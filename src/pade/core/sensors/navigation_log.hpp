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
  Time time;                                           ///< of the state
  Pose T_world_body;                                   ///< ENU, body FLU
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< ENU, m/s
};

/// What a receiver said, in one local frame.
struct GnssLog {
  std::vector<GnssFix> fixes;                ///< in the order of the source
  std::vector<GnssVelocity> velocities;      ///< the same
  std::optional<GeodeticOrigin> origin;      ///< of the local frame, where it is known
  std::optional<Eigen::Vector3d> lever_arm;  ///< antenna in the body frame (FLU), if the file says so
};

/// What a log folder holds. Rows are in the order of the files: stamps may repeat or go back.
struct NavigationLog {
  std::vector<ImuSample> imu;               ///< samples of the inertial unit
  GnssLog gnss;                             ///< positions and velocities
  std::vector<BarometricHeight> barometer;  ///< empty if there is none
  std::vector<MagneticField> magnetometer;  ///< empty if there is none
  std::vector<TrueState> truth;             ///< empty if there is none
  std::vector<std::string> remarks;         ///< rows left out, values filled in: one sentence each
};

}  // namespace pade
