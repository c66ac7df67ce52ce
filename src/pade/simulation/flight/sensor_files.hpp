// What the instruments of a simulated flight would have recorded, as the files of a sequence folder.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "pade/simulation/flight/flight.hpp"

namespace pade::simulation {

/// Where the simulated worlds lie: latitude and longitude in degrees, height in metres.
inline constexpr std::string_view geographic_origin_text = "47.3769, 8.5417, 408";

/// File names and contents: imu.csv, gnss.csv, baro.csv, mag.csv, and body_truth.txt with the body's exact
/// pose (TUM). From the start of the path to its end; stamps are the moments of measurement. With a latency
/// the GNSS rows of the last moments, which would arrive after the end, are missing.
std::map<std::string, std::string> sensor_files(const Trajectory& path, const SensorOptions& options,
                                                std::uint64_t seed);

}  // namespace pade::simulation
