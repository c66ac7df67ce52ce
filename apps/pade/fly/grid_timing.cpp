#include "grid_timing.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "pade/core/compute/median.hpp"
#include "pade/io/text.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

Result<std::vector<ordered_json>> timings_in(const std::vector<fs::path>& folders) {
  std::vector<ordered_json> all;
  for (const fs::path& folder : folders) {
    const fs::path file = folder / "timing.json";
    if (!io::path_exists(file)) continue;
    const auto text = io::read_file(file);
    if (!text) return text.error();
    ordered_json timing = ordered_json::parse(*text, nullptr, false);
    for (const char* field : {"frames", "mean_s", "median_s", "p95_s"}) {
      if (!timing.is_object() || !timing.contains(field) || !timing[field].is_number())
        return Error{fmt::format("{}: found no number {}, expected the timing.json of a flight",
                                 file.string(), field)};
    }
    all.push_back(std::move(timing));
  }
  return all;
}

}  // namespace

Result<ordered_json> timing_of(const std::vector<TimedFlights>& flown) {
  ordered_json rows = ordered_json::array();
  for (const TimedFlights& from : flown) {
    const auto timings = timings_in(from.folders);
    if (!timings) return timings.error();
    if (timings->empty()) continue;
    double frames = 0;
    double seconds = 0;
    double p95 = 0;
    std::vector<double> medians;
    for (const ordered_json& timing : *timings) {
      const auto n = timing["frames"].get<double>();
      frames += n;
      seconds += n * timing["mean_s"].get<double>();
      medians.push_back(timing["median_s"].get<double>());
      p95 = std::max(p95, timing["p95_s"].get<double>());
    }
    rows.push_back({{"configuration", from.configuration},
                    {"world", from.world},
                    {"flights", timings->size()},
                    {"frames", static_cast<std::size_t>(frames)},
                    {"mean_s", frames > 0 ? ordered_json(seconds / frames) : ordered_json()},
                    {"median_s", median(medians)},
                    {"largest_p95_s", p95}});
  }
  return rows;
}

std::string timing_text(const ordered_json& rows) {
  std::string text;
  for (const ordered_json& row : rows) {
    if (!row["mean_s"].is_number()) continue;
    text += fmt::format("{}, {}: {:.0f} ms of processor time per frame (mean of {} frames)\n",
                        row["configuration"].get<std::string>(), row["world"].get<std::string>(),
                        1000 * row["mean_s"].get<double>(), row["frames"].get<std::size_t>());
  }
  return text;
}

}  // namespace pade::cli
