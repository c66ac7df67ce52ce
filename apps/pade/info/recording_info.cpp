#include "info/recording_info.hpp"

#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/text.hpp"
#include "pade/live/recordings/tlog.hpp"
#include "pade/live/recordings/ulog.hpp"

#include "info/info_lines.hpp"
#include "options/json_text.hpp"

namespace pade::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string version_text(const live::TlogSummary& summary) {
  return summary.version == 3 ? "1 and 2" : std::to_string(summary.version);
}

std::string sensors_text(const NavigationLog& log) {
  return fmt::format("IMU {}, GNSS {}, magnetometer {}, barometer {} samples", log.imu.size(),
                     log.gnss.fixes.size(), log.magnetometer.size(), log.barometer.size());
}

void add_sensors(Json& json, const Result<NavigationLog>& sensors) {
  if (!sensors) {
    json["problem"] = sensors.error().message;
    return;
  }
  json["sensors"] = {{"imu", sensors->imu.size()},
                     {"gnss", sensors->gnss.fixes.size()},
                     {"magnetometer", sensors->magnetometer.size()},
                     {"barometer", sensors->barometer.size()}};
}

void print_sensors(const Result<NavigationLog>& sensors) {
  if (sensors) {
    line("sensors", "{}", sensors_text(*sensors));
  } else {
    line("problem", "{}", sensors.error().message);
  }
}

Json tlog_json(const std::filesystem::path& file, const live::TlogSummary& summary,
               const Result<NavigationLog>& sensors) {
  Json json = {{"kind", "tlog"},
               {"file", file.string()},
               {"mavlink", version_text(summary)},
               {"packets", summary.counts.packets},
               {"bad", summary.counts.bad},
               {"unknown", summary.counts.unknown},
               {"gaps", summary.counts.gaps},
               {"lost", summary.counts.lost},
               {"first", to_string(summary.first)},
               {"last", to_string(summary.last)},
               {"autopilot", nullptr},
               {"sensors", nullptr},
               {"problem", nullptr},
               {"messages", Json::array()}};
  if (summary.autopilot) {
    json["autopilot"] = {{"name", live::name_of(*summary.autopilot)},
                         {"system", summary.autopilot->system},
                         {"component", summary.autopilot->component}};
  }
  add_sensors(json, sensors);
  for (const live::MessageCount& m : summary.messages) {
    json["messages"].push_back({{"name", m.name},
                                {"id", m.id},
                                {"system", m.system},
                                {"component", m.component},
                                {"count", m.count}});
  }
  return json;
}

void print_tlog(const std::filesystem::path& file, const live::TlogSummary& summary,
                const Result<NavigationLog>& sensors) {
  const double duration = seconds_between(summary.first, summary.last);
  const auto& counts = summary.counts;
  fmt::print("{}: recording of MAVLink {}, {:.1f} s\n", file.string(), version_text(summary), duration);
  line("packets", "{}, {} bad, {} of unknown messages; {} gaps, {} packets lost in them", counts.packets,
       counts.bad, counts.unknown, counts.gaps, counts.lost);
  if (summary.autopilot) {
    line("autopilot", "{}, system {}, component {}", live::name_of(*summary.autopilot),
         summary.autopilot->system, summary.autopilot->component);
  }
  print_sensors(sensors);
  fmt::print("  {:<12} {:>5} {:>5} {:>8} {:>8}  message\n", "messages", "from", "id", "count", "Hz");
  for (const live::MessageCount& m : summary.messages) {
    const double rate = duration > 0 ? static_cast<double>(m.count) / duration : 0;
    fmt::print("  {:<12} {:>5} {:>5} {:>8} {:>8.2f}  {}\n", "", fmt::format("{}.{}", m.system, m.component),
               m.id, m.count, rate, m.name);
  }
}

/// The rate of a topic by its stamps, Hz; 0 if it has not two.
double rate_of(const live::Ulog& log, const live::Ulog::Topic& topic) {
  const auto stamps = log.column(topic, "timestamp");
  if (!stamps || stamps->size() < 2 || !(stamps->back() > stamps->front())) return 0;
  return 1e6 * static_cast<double>(stamps->size() - 1) / (stamps->back() - stamps->front());
}

Json ulog_json(const std::filesystem::path& file, const live::Ulog& log,
               const Result<NavigationLog>& sensors) {
  Json json = {{"kind", "ulog"},     {"file", file.string()}, {"remarks", log.remarks()},
               {"sensors", nullptr}, {"problem", nullptr},    {"topics", Json::array()}};
  add_sensors(json, sensors);
  for (const live::Ulog::Topic& topic : log.topics()) {
    json["topics"].push_back(
        {{"name", topic.name}, {"instance", topic.instance}, {"count", topic.rows.size()}});
  }
  return json;
}

void print_ulog(const std::filesystem::path& file, const live::Ulog& log,
                const Result<NavigationLog>& sensors) {
  fmt::print("{}: log of PX4\n", file.string());
  for (const std::string& remark : log.remarks()) line("remark", "{}", remark);
  print_sensors(sensors);
  fmt::print("  {:<12} {:>8} {:>8}  topic\n", "topics", "count", "Hz");
  for (const live::Ulog::Topic& topic : log.topics()) {
    if (topic.rows.empty()) continue;
    const std::string name =
        topic.instance == 0 ? topic.name : fmt::format("{} {}", topic.name, topic.instance);
    fmt::print("  {:<12} {:>8} {:>8.2f}  {}\n", "", topic.rows.size(), rate_of(log, topic), name);
  }
}

}  // namespace

Status inform_of_ulog(const std::filesystem::path& file, bool as_json) {
  auto bytes = io::read_file(file);
  if (!bytes) return bytes.error();
  const auto log = live::Ulog::parse(std::move(*bytes), file.string());
  if (!log) return log.error();
  const Result<NavigationLog> sensors = live::read_ulog_sensors(file);
  if (as_json) {
    fmt::print("{}\n", json_text(ulog_json(file, *log, sensors)));
  } else {
    print_ulog(file, *log, sensors);
  }
  return {};
}

Status inform_of_tlog(const std::filesystem::path& file, bool as_json) {
  const auto bytes = live::read_tlog(file);
  if (!bytes) return bytes.error();
  const live::TlogSummary summary = live::summarise(*bytes);
  const Result<NavigationLog> sensors = live::read_tlog_sensors(file);
  if (as_json) {
    fmt::print("{}\n", json_text(tlog_json(file, summary, sensors)));
  } else {
    print_tlog(file, summary, sensors);
  }
  return {};
}

}  // namespace pade::cli
