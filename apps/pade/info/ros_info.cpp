#include <algorithm>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/sequence/sequence.hpp"

#include "info/info_lines.hpp"
#include "info/recording_info.hpp"
#include "options/json_text.hpp"

namespace pade::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Messages per second between the first and the last; 0 where there are not two moments.
double rate_of(const io::Topic& topic) {
  if (topic.messages.size() < 2) return 0;
  const double span = seconds_between(topic.messages.front().time, topic.messages.back().time);
  return span > 0 ? static_cast<double>(topic.messages.size() - 1) / span : 0;
}

/// When the recording begins and ends, if there is a message at all.
std::optional<std::pair<Time, Time>> span_of(const io::Recording& recording) {
  std::optional<std::pair<Time, Time>> span;
  for (const io::Topic& topic : recording.topics()) {
    if (topic.messages.empty()) continue;
    const Time first = topic.messages.front().time, last = topic.messages.back().time;
    span =
        span ? std::pair(std::min(span->first, first), std::max(span->second, last)) : std::pair(first, last);
  }
  return span;
}

bool has_type(const io::Recording& recording, std::string_view type) {
  return std::any_of(recording.topics().begin(), recording.topics().end(),
                     [&](const io::Topic& topic) { return topic.type == type && !topic.messages.empty(); });
}

void print_topics(const io::Recording& recording) {
  fmt::print("{}: {} recording, {} topics\n", recording.file().string(), recording.format(),
             recording.topics().size());
  if (const auto span = span_of(recording)) {
    line("time", "{} to {}, {:.3f} s", to_string(span->first), to_string(span->second),
         seconds_between(span->first, span->second));
  }
  for (const io::Topic& topic : recording.topics()) {
    line("topic", "{:<32} {:<28} {:>7} messages {:>8.2f} Hz{}", topic.name, topic.type, topic.messages.size(),
         rate_of(topic),
         topic.encoding == "ros1" || topic.encoding == "cdr"
             ? ""
             : fmt::format("  ({}, not read)", topic.encoding));
  }
  for (const std::string& remark : recording.remarks()) line("note", "{}", remark);
}

Json topics_json(const io::Recording& recording) {
  Json topics = Json::array();
  for (const io::Topic& topic : recording.topics()) {
    topics.push_back({{"name", topic.name},
                      {"type", topic.type},
                      {"encoding", topic.encoding},
                      {"messages", topic.messages.size()},
                      {"rate_hz", rate_of(topic)}});
  }
  return topics;
}

/// What reading the sensors had to say beyond what opening had.
std::vector<std::string> notes_of(const io::Recording& recording, const NavigationLog& sensors) {
  const auto first = sensors.remarks.begin() + static_cast<std::ptrdiff_t>(recording.remarks().size());
  return {first, sensors.remarks.end()};
}

}  // namespace

Result<bool> inform_of_ros_recording(const std::filesystem::path& file, const std::string& topics,
                                     bool as_json) {
  const auto recording = io::Recording::open(file);
  if (!recording) return recording.error();
  std::optional<Result<NavigationLog>> sensors;
  if (has_type(*recording, "sensor_msgs/Imu")) sensors = io::read_recording_sensors(file, topics);
  const bool images =
      has_type(*recording, "sensor_msgs/Image") || has_type(*recording, "sensor_msgs/CompressedImage");
  if (!as_json) {
    print_topics(*recording);
    if (sensors && !*sensors) line("sensors", "{}", sensors->error().message);
    if (sensors && *sensors) {
      for (const std::string& remark : notes_of(*recording, **sensors)) line("note", "{}", remark);
      line("sensors", "IMU {}, GNSS {}, magnetometer {}, barometer {} samples", (*sensors)->imu.size(),
           (*sensors)->gnss.fixes.size(), (*sensors)->magnetometer.size(), (*sensors)->barometer.size());
    }
    return images;
  }
  Json json = {{"kind", "recording"},
               {"file", recording->file().string()},
               {"format", recording->format()},
               {"first", nullptr},
               {"last", nullptr},
               {"topics", topics_json(*recording)},
               {"notes", recording->remarks()},
               {"sensors", nullptr},
               {"frames_usable", nullptr},
               {"problems", Json::array()}};
  if (const auto span = span_of(*recording)) {
    json["first"] = to_string(span->first);
    json["last"] = to_string(span->second);
  }
  if (sensors && *sensors) {
    for (const std::string& remark : notes_of(*recording, **sensors)) json["notes"].push_back(remark);
    json["sensors"] = {{"imu", (*sensors)->imu.size()},
                       {"gnss", (*sensors)->gnss.fixes.size()},
                       {"magnetometer", (*sensors)->magnetometer.size()},
                       {"barometer", (*sensors)->barometer.size()}};
  } else if (sensors) {
    json["problems"].push_back(sensors->error().message);
  }
  if (images) {
    io::SequenceOptions options;
    options.topics = topics;
    const auto sequence = io::Sequence::open(file, options);
    if (sequence) {
      json["frames_usable"] = sequence->size();
    } else {
      json["problems"].push_back(sequence.error().message);
    }
  }
  fmt::print("{}\n", json_text(json));
  return false;
}

}  // namespace pade::cli
