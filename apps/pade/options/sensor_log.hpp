// The log of a vehicle's sensors, of whatever kind: a folder, a recording of ROS, an autopilot's log.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/offline/checked_log.hpp"

namespace pade::cli {

/// Errors: those of io::read_navigation_log, live::read_ulog_sensors, live::read_tlog_sensors; options that
/// an autopilot's log has no use for.
Result<CheckedLog> read_sensor_log(const std::filesystem::path& path,
                                   const io::NavigationLogOptions& options = {});

/// The same where the IMU alone matters. Its stamps are as they stand there.
Result<NavigationLog> read_imu_log(const std::filesystem::path& path, const std::string& topics = {});

}  // namespace pade::cli
