#include "pade/live/recordings/tlog.hpp"

#include <algorithm>
#include <map>
#include <tuple>

#include <fmt/format.h>

#include "pade/io/text.hpp"
#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/known_messages.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {
namespace {

using mavlink::Found;

constexpr std::size_t kStamp = 8;  // bytes

Time arrival_before(std::span<const std::uint8_t> bytes, std::size_t position) {
  if (position < kStamp) return {};
  std::uint64_t microseconds = 0;
  for (std::size_t i = position - kStamp; i < position; ++i) microseconds = microseconds << 8U | bytes[i];
  constexpr std::uint64_t kLast = 4'600'000'000'000'000;  // the year 2115
  return {static_cast<std::int64_t>(std::min(microseconds, kLast)) * 1000};
}

/// Whether a packet follows at the right distance, so that the length of an unknown one can be believed.
bool continues(std::span<const std::uint8_t> bytes, std::size_t end) {
  if (end == bytes.size()) return true;
  if (end + kStamp >= bytes.size()) return false;
  const std::uint8_t start = bytes[end + kStamp];
  return start == mavlink::kStart1 || start == mavlink::kStart2;
}

/// The autopilot among the senders.
class FindAutopilot {
 public:
  void add(const mavlink::Frame& frame) {
    const auto heartbeat = mavlink::unpack<mavlink::Heartbeat>(frame);
    if (!heartbeat || heartbeat->autopilot == mavlink::kNoAutopilot) return;
    auto& [autopilot, count] = found_[{frame.system, frame.component}];
    autopilot = {frame.system, frame.component, heartbeat->autopilot, heartbeat->type};
    ++count;
  }
  [[nodiscard]] std::optional<Autopilot> best() const {
    std::optional<Autopilot> best;
    std::size_t most = 0;
    for (const auto& [sender, one] : found_) {
      if (one.second > most) {
        best = one.first;
        most = one.second;
      }
    }
    return best;
  }

 private:
  std::map<std::pair<std::uint8_t, std::uint8_t>, std::pair<Autopilot, std::size_t>> found_;
};

}  // namespace

bool is_tlog(const std::filesystem::path& file) { return file.extension() == ".tlog"; }

mavlink::LinkCounts for_each_packet(std::span<const std::uint8_t> bytes,
                                    const std::function<void(const TlogPacket&)>& take) {
  mavlink::LinkCounts counts;
  mavlink::SequenceWatch watch;
  std::size_t at = kStamp;  // where a packet may begin
  bool in_step = true;      // and is due there
  while (at < bytes.size()) {
    const mavlink::Look seen = mavlink::look(bytes.subspan(at));
    if (seen.found == Found::frame) {
      watch.add(seen.frame, counts);
      take({seen.frame, arrival_before(bytes, at), at});
      at += seen.length + kStamp;
      in_step = true;
      continue;
    }
    if (seen.found == Found::unknown && in_step && continues(bytes, at + seen.length)) {
      ++counts.unknown;
      watch.pass(seen.frame);
      at += seen.length + kStamp;
      continue;
    }
    if (in_step || seen.found == Found::bad_checksum) ++counts.bad;
    in_step = false;
    ++at;
    ++counts.skipped_bytes;
  }
  return counts;
}

Result<std::vector<std::uint8_t>> read_tlog(const std::filesystem::path& file) {
  const auto text = io::read_file(file);
  if (!text) return text.error();
  std::vector<std::uint8_t> bytes(text->begin(), text->end());
  bool any = false;
  for_each_packet(bytes, [&](const TlogPacket&) { any = true; });
  if (!any) {
    return Error{fmt::format("{}: found no packet of MAVLink in its {} bytes, expected a .tlog",
                             file.string(), bytes.size())};
  }
  return bytes;
}

TlogSummary summarise(std::span<const std::uint8_t> bytes) {
  TlogSummary summary;
  FindAutopilot autopilots;
  std::map<std::tuple<std::uint8_t, std::uint8_t, std::uint32_t>, std::size_t> messages;
  summary.counts = for_each_packet(bytes, [&](const TlogPacket& packet) {
    if (messages.empty()) summary.first = packet.arrival;
    summary.last = packet.arrival;
    summary.version = static_cast<std::uint8_t>(summary.version | packet.frame.version);
    ++messages[{packet.frame.system, packet.frame.component, packet.frame.id}];
    autopilots.add(packet.frame);
  });
  summary.autopilot = autopilots.best();
  for (const auto& [key, count] : messages) {
    const auto [system, component, id] = key;
    const mavlink::KnownMessage* const known = mavlink::known_message(id);
    summary.messages.push_back({system, component, id, std::string(known->name), count});
  }
  if (!summary.autopilot) return summary;
  for_each_packet(bytes, [&](const TlogPacket& packet) {
    const bool autopilot = packet.frame.system == summary.autopilot->system &&
                           packet.frame.component == summary.autopilot->component;
    if (autopilot) summary.clock.learn(packet.frame);
  });
  return summary;
}

Result<NavigationLog> read_tlog_sensors(const std::filesystem::path& file, SensorNeed need) {
  const auto bytes = read_tlog(file);
  if (!bytes) return bytes.error();
  const TlogSummary summary = summarise(*bytes);
  if (!summary.autopilot) {
    return Error{
        fmt::format("{}: the autopilot is missing: found {} packets and among them no HEARTBEAT of one",
                    file.string(), summary.counts.packets)};
  }
  SensorGatherer sensors(*summary.autopilot, summary.clock);
  const auto counts = for_each_packet(*bytes, [&](const TlogPacket& packet) { sensors.add(packet.frame); });
  auto log = sensors.log(file.string(), need);
  if (!log) return log.error();
  log->remarks.insert(log->remarks.begin(),
                      fmt::format("{}: {} packets, {} bad, {} gaps in their numbers; stamps are those of {} "
                                  "since its start",
                                  file.filename().string(), counts.packets, counts.bad, counts.gaps,
                                  name_of(*summary.autopilot)));
  return log;
}

}  // namespace pade::live
