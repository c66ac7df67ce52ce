// What a frame of the chain took, over all flights of a grid: with a clock in it, so apart from the tables.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "pade/core/result.hpp"

namespace pade::cli {

/// The flights of one configuration in one kind of world.
struct TimedFlights {
  std::string configuration;
  std::string world;
  std::vector<std::filesystem::path> folders;  ///< one per flight; those without timing.json do not count
};

/// One row per entry that has flights with timing.json: flights, frames, the mean over frames, the median of
/// the flights' medians and the largest of their 95 %, processor seconds.
Result<nlohmann::ordered_json> timing_of(const std::vector<TimedFlights>& flown);

/// A line per row; empty without rows.
std::string timing_text(const nlohmann::ordered_json& rows);

}  // namespace pade::cli
