#include "pade/io/foreign_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace pade::io {

std::string advice_for(const std::filesystem::path& file) {
  constexpr std::string_view kUlog =
      "a log of PX4, which pade navigate reads as it is; elsewhere make tables of it (ulog2csv) and name "
      "them imu.csv "
      "(sensor_combined) and gnss.csv (vehicle_gps_position)";
  constexpr std::string_view kTlog =
      "a recording of a ground station, which pade navigate and pade info read as it is, and nothing else "
      "does";
  constexpr std::string_view kArduPilot =
      "a log of ArduPilot: make tables of it (mavlogdump.py --format csv --types IMU, then GPS) and name "
      "them "
      "imu.csv and gnss.csv";
  constexpr std::string_view kBag =
      "a recording of ROS, but does not begin as one: pade map, navigate, info and convert read rosbag 2.0, "
      "MCAP and "
      "rosbag2's SQLite";
  constexpr std::string_view kFilm =
      "a film: write its frames into rgb/ as PNG, named by their times in seconds";
  constexpr std::string_view kPacked = "a file that is compressed as a whole: decompress it (zstd -d)";
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kKinds = {
      {{".ulg", kUlog},
       {".bin", kArduPilot},
       {".log", kArduPilot},
       {".tlog", kTlog},
       {".bag", kBag},
       {".mcap", kBag},
       {".db3", kBag},
       {".mp4", kFilm},
       {".mov", kFilm},
       {".avi", kFilm},
       {".mkv", kFilm},
       {".webm", kFilm},
       {".zstd", kPacked},
       {".zst", kPacked}}};
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [known, advice] : kKinds) {
    if (ending == known) return fmt::format("; it looks like {} (docs/formats.md)", advice);
  }
  return {};
}

std::string found_files(const std::filesystem::path& folder, const std::string& ending) {
  std::vector<std::string> names;
  std::error_code failure;
  for (std::filesystem::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    if (entry->path().extension() == ending) names.push_back(entry->path().filename().string());
  }
  if (names.empty()) return {};
  std::sort(names.begin(), names.end());
  constexpr std::size_t kMost = 6;
  const bool more = names.size() > kMost;
  if (more) names.resize(kMost);
  return fmt::format("; found {}{}", fmt::join(names, ", "), more ? " ..." : "");
}

}  // namespace pade::io
