// What `pade info` says of a ground station's recording.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"

namespace pade::cli {

/// Prints packets, messages and their rates, and what its sensors are good for. Errors: live::read_tlog.
Status inform_of_tlog(const std::filesystem::path& file, bool as_json);

}  // namespace pade::cli
