// What `pade convert` makes of a flight in a folder.
#pragma once

#include <array>
#include <filesystem>
#include <string_view>

#include "pade/io/recording/flight/flight_writer.hpp"

#include "options/own_folder.hpp"

namespace pade::cli {

inline constexpr std::string_view kFlightMarker = "camera.yaml";
inline constexpr std::string_view kFlightWords = "# written by pade";
inline constexpr std::array<std::string_view, 8> kFlightFiles = {
    "rgb", "groundtruth.txt", kFlightMarker, "mask.png", "imu.csv", "gnss.csv", "mag.csv", "baro.csv"};

/// Whether --force may replace the folder.
inline Status check_own_flight(const std::filesystem::path& folder) {
  return check_own(folder, {kFlightMarker, kFlightWords, kFlightFiles, io::flight_files_line});
}

}  // namespace pade::cli
