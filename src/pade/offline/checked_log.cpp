#include "pade/offline/checked_log.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "pade/navigation/plausibility/plausibility.hpp"

namespace pade {

Result<CheckedLog> read_checked_log(const std::filesystem::path& folder,
                                    const io::NavigationLogOptions& options) {
  auto log = io::read_navigation_log(folder, options);
  if (!log) return log.error();
  return checked_log(std::move(*log));
}

CheckedLog checked_log(NavigationLog log) {
  CheckedLog checked{std::move(log), {}};
  auto regularised = navigation::regularise_stamps(checked.log.imu);
  checked.hints = navigation::check_log(checked.log);
  if (regularised) checked.hints.push_back(std::move(*regularised));
  return checked;
}

void check_with_latencies(CheckedLog& checked, const navigation::NavigatorOptions& latencies) {
  if (latencies.gnss_position_latency == 0 && latencies.gnss_velocity_latency == 0 &&
      latencies.barometer_latency == 0 && latencies.magnetometer_latency == 0)
    return;
  NavigationLog log = checked.log;
  const auto shift = [](auto& items, double latency) {
    for (auto& item : items) item.time.nanoseconds -= Time::from_seconds(latency).nanoseconds;
  };
  shift(log.gnss.fixes, latencies.gnss_position_latency);
  shift(log.gnss.velocities, latencies.gnss_velocity_latency);
  shift(log.barometer, latencies.barometer_latency);
  shift(log.magnetometer, latencies.magnetometer_latency);
  std::vector<Hint> hints = navigation::check_log(log);
  for (Hint& hint : checked.hints) {
    if (hint.id == "imu-stamps-regularised") hints.push_back(std::move(hint));
  }
  checked.hints = std::move(hints);
}

std::vector<Hint> all_hints(const CheckedLog& checked, const NavigationRun& run) {
  std::vector<Hint> hints = checked.hints;
  const auto of_run = navigation::check_run(run.health.sensors, run.health.filter, checked.log.imu.size());
  hints.insert(hints.end(), of_run.begin(), of_run.end());
  std::stable_sort(hints.begin(), hints.end(),
                   [](const Hint& a, const Hint& b) { return a.severity > b.severity; });
  return hints;
}

Error never_aligned(const std::string& folder, const CheckedLog& checked, const NavigationRun& run) {
  std::string text = fmt::format("{}: the filter never found its attitude and yaw (status: {})", folder,
                                 to_name(run.health.filter.status));
  const std::vector<Hint> hints = all_hints(checked, run);
  for (const Hint& hint : hints) text += fmt::format("\n  {}\n  -> {}", hint.message, hint.advice);
  if (hints.empty()) {
    text += ", expected two seconds at rest and a heading, or GNSS velocities of a vehicle that accelerates";
  }
  for (const std::string& remark : checked.log.remarks) text += "\n  " + remark;
  return Error{text};
}

}  // namespace pade
