// What `pade info` says of the recordings of autopilots.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"

namespace pade::cli {

/// Prints packets, messages and their rates, and what its sensors are good for. Errors: live::read_tlog.
Status inform_of_tlog(const std::filesystem::path& file, bool as_json);

/// Prints topics and their rates, and what its sensors are good for. Errors: live::Ulog::parse.
Status inform_of_ulog(const std::filesystem::path& file, bool as_json);

}  // namespace pade::cli
