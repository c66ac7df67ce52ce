#include "sensor_log.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/recording.hpp"
#include "pade/live/recordings/tlog.hpp"
#include "pade/live/recordings/ulog.hpp"
#include "pade/navigation/plausibility/plausibility.hpp"

namespace pade::cli {
namespace {

/// Nothing where it is none.
std::optional<Result<NavigationLog>> autopilot_log(const std::filesystem::path& path,
                                                   const io::NavigationLogOptions& options,
                                                   live::SensorNeed need) {
  const bool px4 = live::is_ulog(path);
  if (!px4 && !live::is_tlog(path)) return std::nullopt;
  if (!options.gnss.empty()) return Error{"--gnss: found a recording, which has one GNSS; expected a folder"};
  if (!options.topics.empty())
    return Error{
        "--topics: found an autopilot's log, which has none to choose from; expected a recording of ROS"};
  return px4 ? live::read_ulog_sensors(path, need) : live::read_tlog_sensors(path, need);
}

}  // namespace

Result<CheckedLog> read_sensor_log(const std::filesystem::path& path,
                                   const io::NavigationLogOptions& options) {
  auto sensors = autopilot_log(path, options, live::SensorNeed::imu_and_gnss);
  if (!sensors) return read_checked_log(path, options);
  if (!*sensors) return sensors->error();
  return checked_log(std::move(**sensors));
}

Result<NavigationLog> read_imu_log(const std::filesystem::path& path, const std::string& topics) {
  io::NavigationLogOptions options;
  options.topics = topics;
  auto log = autopilot_log(path, options, live::SensorNeed::imu);
  if (!log && io::is_recording(path)) {
    auto some = io::read_some_sensors(path, topics);
    if (!some) return some.error();
    log = std::move(some->log);
  }
  if (!log) log = io::read_navigation_log(path, options);
  if (!*log) return log->error();
  if ((*log)->imu.empty()) {
    return Error{
        fmt::format("{}: the IMU is missing: found no sample of one, expected some hundred", path.string())};
  }
  if (auto regular = navigation::regularise_stamps((*log)->imu))
    (*log)->remarks.push_back(fmt::format("{} -> {}", regular->message, regular->advice));
  return std::move(**log);
}

}  // namespace pade::cli
