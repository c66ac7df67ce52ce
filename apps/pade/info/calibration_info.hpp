// What `pade info` says of a calibration.
#pragma once

#include <filesystem>

#include "pade/core/result.hpp"

namespace pade::cli {

/// Prints what is understood of it. Errors: io::read_calibration; no camera in it.
/// @param camera_number  which camera, where the file holds several
Status inform_of_calibration(const std::filesystem::path& file, int camera_number, bool as_json);

}  // namespace pade::cli
