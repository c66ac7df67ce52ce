#include "pade/live/web/session_health.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "pade/io/text.hpp"

namespace pade::live {
namespace {

double processor_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_megabytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::string age_of(std::int64_t then, Time now) {
  return then == 0 ? std::string("none") : fmt::format("{:.2f}", seconds_between({then}, now));
}

std::string milliseconds(double seconds) {
  return std::isnan(seconds) ? std::string("none") : fmt::format("{:.0f}", 1e3 * seconds);
}

std::string fix_name(const std::optional<GnssState>& gnss) {
  if (!gnss) return "not sent";
  switch (gnss->fix) {
    case 0:
      return "no receiver";
    case 1:
      return "none";
    case 2:
      return "2D";
    case 3:
      return "3D";
    case 4:
      return "differential";
    case 5:
      return "RTK float";
    case 6:
      return "RTK fixed";
    default:
      return fmt::format("{}", gnss->fix);
  }
}

std::string satellites_of(const std::optional<GnssState>& gnss) {
  constexpr std::uint8_t kNotSaid = 255;
  return !gnss || gnss->satellites == kNotSaid ? std::string("not sent")
                                               : fmt::format("{}", gnss->satellites);
}

}  // namespace

io::Diagnosis SessionHealth::of(const HealthInputs& inputs) {
  constexpr double kWindow = 3;  // s
  const Past now{inputs.now,        inputs.counts.frames, inputs.counts.mapped, inputs.link.sectors_sent,
                 inputs.link.poses, processor_seconds()};
  past_.push_back(now);
  while (past_.size() > 2 && seconds_between(past_[1].time, now.time) > kWindow) past_.pop_front();
  const Past& then = past_.front();
  const double elapsed = seconds_between(then.time, now.time);
  const auto rate = [&](std::size_t Past::*count) {
    if (!(elapsed > 0)) return std::string("none");
    return fmt::format("{:.1f}", static_cast<double>(now.*count - then.*count) / elapsed);
  };
  const SessionCounts& counts = inputs.counts;
  const LinkReport& link = inputs.link;
  io::Diagnosis diagnosis{static_cast<std::uint8_t>(link.missing == Missing::nothing ? 0 : 2), "pade live",
                          inputs.missing};
  const auto put = [&](const char* key, std::string value) {
    diagnosis.values.emplace_back(key, std::move(value));
  };
  put("image_age_s", age_of(inputs.image, inputs.now));
  put("depth_age_s", age_of(inputs.depth, inputs.now));
  put("camera_hz", rate(&Past::frames));
  put("mapped_hz", rate(&Past::mapped));
  put("sectors_hz", rate(&Past::sectors));
  put("poses_hz", rate(&Past::poses));
  put("latency_ms", milliseconds(inputs.latency));
  put("latency_95_ms", milliseconds(inputs.latency_95));
  put("frames", fmt::format("{}", counts.frames));
  put("mapped", fmt::format("{}", counts.mapped));
  put("skipped", fmt::format("{}", counts.skipped));
  put("dropped", fmt::format("{}", counts.dropped));
  put("maps_begun_anew", fmt::format("{}", counts.restarts));
  put("depth_share", fmt::format("{:.2f}", inputs.depth_share));
  put("voxels_occupied", fmt::format("{}", inputs.occupied));
  put("autopilot", link.autopilot ? std::string(name_of(*link.autopilot)) : std::string("none"));
  put("clock", link.synchronised ? fmt::format("within {:.1f} ms", 1e3 * link.clock_bound)
                                 : std::string("not synchronised"));
  put("gnss_fix", fix_name(link.gnss));
  put("gnss_satellites", satellites_of(link.gnss));
  put("pose_jumps", fmt::format("{}", link.jumps));
  put("packets", fmt::format("{}", link.in.packets));
  put("packets_bad", fmt::format("{}", link.in.bad));
  put("packets_lost", fmt::format("{}", link.in.lost));
  put("processor_cores",
      elapsed > 0 ? fmt::format("{:.2f}", (now.processor - then.processor) / elapsed) : std::string("none"));
  put("memory_peak_mb", fmt::format("{:.0f}", peak_megabytes()));
  put("web_clients", fmt::format("{}", inputs.web.clients));
  put("web_dropped", fmt::format("{}", inputs.web.dropped));
  put("web_refused", fmt::format("{}", inputs.web.refused));
  if (!inputs.web.last_refusal.empty()) put("web_last_refusal", inputs.web.last_refusal);
  if (!inputs.stamps.empty()) put("stamps", inputs.stamps);
  std::string reasons;
  for (const auto& [reason, count] : counts.reasons)
    reasons += fmt::format("{}{}: {}", reasons.empty() ? "" : "; ", reason, count);
  if (!reasons.empty()) put("skipped_because", reasons);
  return diagnosis;
}

std::string json_of(const io::Diagnosis& diagnosis) {
  nlohmann::ordered_json values = nlohmann::ordered_json::object();
  for (const auto& [key, value] : diagnosis.values) values[key] = value;
  const nlohmann::ordered_json json = {
      {"level", diagnosis.level}, {"message", diagnosis.message}, {"values", std::move(values)}};
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace pade::live
