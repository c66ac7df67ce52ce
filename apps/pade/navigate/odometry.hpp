// `pade navigate` on raw GNSS and odometry, without an IMU.
#pragma once

#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/navigation/odometry/planar_run.hpp"

namespace pade::cli {

struct OdometryArguments {
  std::string log;
  std::string out;
  navigation::PlanarCoupling coupling = navigation::PlanarCoupling::tight;
  gnss::PositioningOptions positioning;
  bool force = false;
  bool json = false;
  std::vector<std::string> remarks;  ///< to be shown with those of the recording
};

/// Whether a file, or a folder's only raw GNSS, is of libRSF's lines.
bool is_known_ranges(const std::string& path);

/// Plays the ranges and the odometry of a folder or file and writes the output folder. Errors: those of the
/// reader; no odometry; no position.
Status navigate_odometry(const OdometryArguments& arguments);

}  // namespace pade::cli
