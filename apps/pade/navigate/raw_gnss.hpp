// `pade navigate` on raw GNSS alone.
#pragma once

#include <string>

#include "pade/core/result.hpp"
#include "pade/navigation/gnss/positioning.hpp"

namespace pade::cli {

struct RawGnssArguments {
  std::string log;
  std::string out;
  gnss::PositioningOptions options;
  bool force = false;
  bool json = false;
};

/// Whether the path is a file of RINEX, UBX or libRSF ranges, or named as one of the first two.
bool is_raw_gnss_file(const std::string& path);

/// Plays the raw GNSS of a folder or file and writes the output folder.
Status navigate_raw(const RawGnssArguments& arguments);

}  // namespace pade::cli
