// What `pade info` says of recordings: those of autopilots, and of ROS.
#pragma once

#include <filesystem>
#include <string>

#include "pade/core/result.hpp"

namespace pade::cli {

/// Prints packets, messages and their rates, and what its sensors are good for. Errors: live::read_tlog.
Status inform_of_tlog(const std::filesystem::path& file, bool as_json);

/// Prints topics and their rates, and what its sensors are good for. Errors: live::Ulog::parse.
Status inform_of_ulog(const std::filesystem::path& file, bool as_json);

/// Prints topics and their rates, and what the sensors are good for; as JSON also whether it is a flight.
/// Errors: io::Recording::open.
/// @param topics  that are meant where several fit
/// @return whether it has images and is yet to be looked at as a sequence
Result<bool> inform_of_ros_recording(const std::filesystem::path& file, const std::string& topics,
                                     bool as_json);

}  // namespace pade::cli
