#include "pade/io/run/run_info.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "pade/io/run/health_json.hpp"
#include "pade/io/run/run_fields.hpp"

namespace pade::io {
namespace {

using Json = nlohmann::ordered_json;
using Fields = RunFields;

constexpr std::string_view kRunFormat = "pade run 2";
constexpr double kUnlimitedScale = 500;

constexpr auto camera_fields = [](auto& camera, auto&& field) {
  field("width", camera.width, "pixels");
  field("height", camera.height, "pixels");
  field("fx", camera.fx, "pixels");
  field("fy", camera.fy, "pixels");
  field("cx", camera.cx, "pixels");
  field("cy", camera.cy, "pixels");
};
constexpr auto map_fields = [](auto& map, auto&& field) {
  field("voxel_m", map.voxel, "metres");
  field("occupied_voxels", map.occupied_voxels, "a count");
  field("free_voxels", map.free_voxels, "a count");
  field("depths", map.depths, "a count");
  field("depths_beyond_range", map.depths_beyond, "a count");
  field("depths_uncertain", map.depths_uncertain, "a count");
  field("points_outside", map.points_outside, "a count");
  field("voxel_hits", map.hits, "a count");
};
constexpr auto motion_fields = [](auto& motion, auto&& field) {
  field("pairs", motion.pairs, "a count");
  field("still_pairs", motion.still_pairs, "a count");
  field("baseline_m", motion.baseline, "metres");
  field("rotation_sigma_deg", motion.rotation_sigma, "degrees");
  field("direction_sigma_deg", motion.direction_sigma, "degrees");
};
constexpr auto offset_fields = [](auto& offset, auto&& field) {
  field("seconds", offset.seconds, "seconds");
  field("sigma_s", offset.sigma, "seconds");
  field("pairs", offset.pairs, "a count");
};
constexpr auto hint_fields = [](auto& hint, auto&& field) {
  field("id", hint.id, "a name");
  field("severity", hint.severity, "warning or error");
  field("message", hint.message, "text");
  field("advice", hint.advice, "text");
};
constexpr auto origin_fields = [](auto& origin, auto&& field) {
  field("latitude_deg", origin.latitude_deg, "degrees");
  field("longitude_deg", origin.longitude_deg, "degrees");
  field("height_m", origin.height, "metres");
};
constexpr auto stage_fields = [](auto& stage, auto&& field) {
  field("stage", stage.stage, "text");
  field("frames", stage.count, "a count");
  field("mean_ms", stage.mean, "milliseconds");
  field("p50_ms", stage.p50, "milliseconds");
  field("p99_ms", stage.p99, "milliseconds");
  field("max_ms", stage.max, "milliseconds");
};

template <class List, class Items>
Json list_by(const List& list, const Items& items) {
  Json json = Json::array();
  for (const auto& item : items) json.push_back(json_by(list, item));
  return json;
}

Json json_of_states(const std::array<std::uint64_t, depth_state_names.size()>& pixels) {
  const double total = static_cast<double>(std::accumulate(pixels.begin(), pixels.end(), std::uint64_t{0}));
  Json states = Json::array();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    states.push_back({{"value", i},
                      {"name", depth_state_names[i]},
                      {"pixels", pixels[i]},
                      {"share", total > 0 ? static_cast<double>(pixels[i]) / total : 0.0}});
  }
  return states;
}

template <class List, class Item>
void read_list(std::vector<Fields> fields, const List& list, std::vector<Item>& items) {
  for (Fields& one : fields) one.read_all(list, items.emplace_back());
}

void read_optional_parts(Fields& fields, RunInfo& info) {
  if (fields.has("world_up")) {
    Fields up = fields.object("world_up");
    std::vector<double> direction;
    info.world_up.emplace();
    up.read("direction", direction, "three numbers");
    up.read("stated", info.world_up->stated, "true or false");
    up.read("source", info.world_up->source, "text");
    if (direction.size() == 3)
      info.world_up->direction = Eigen::Vector3d(direction[0], direction[1], direction[2]);
  }
  if (fields.has("stamp_offset")) {  // absent in runs of earlier versions
    fields.object("stamp_offset").read_all(offset_fields, info.motion.stamp_offset.emplace());
  }
  if (fields.has("geographic_origin")) {
    fields.object("geographic_origin").read_all(origin_fields, info.origin.emplace());
  }
  if (fields.has("local_origin_m")) {  // absent in runs of earlier versions
    std::vector<double> origin;
    fields.read("local_origin_m", origin, "three numbers");
    if (origin.size() == 3) info.local_origin = Eigen::Vector3d(origin[0], origin[1], origin[2]);
  }
  if (fields.has("map")) {
    fields.object("map").read_all(map_fields, info.map.emplace());
  }
}

Result<Json> parse(std::string_view text, std::string_view file) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    return Error{fmt::format("{}: byte {}: found no JSON, expected what pade wrote ({})", file, error.byte,
                             error.what())};
  }
}

double seconds_of(clockid_t clock) {
  timespec now{};
  return ::clock_gettime(clock, &now) == 0
             ? static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec)
             : 0;
}

double nearest_rank(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

}  // namespace

StageTiming summarise(std::string_view stage, std::vector<double> milliseconds) {
  StageTiming timing;
  timing.stage = stage;
  timing.count = milliseconds.size();
  if (milliseconds.empty()) return timing;
  std::sort(milliseconds.begin(), milliseconds.end());
  timing.mean = std::accumulate(milliseconds.begin(), milliseconds.end(), 0.0) /
                static_cast<double>(milliseconds.size());
  timing.p50 = nearest_rank(milliseconds, 0.50);
  timing.p99 = nearest_rank(milliseconds, 0.99);
  timing.max = milliseconds.back();
  return timing;
}

std::uint64_t peak_memory() {
  rusage usage{};
  return ::getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<std::uint64_t>(usage.ru_maxrss) * 1024 : 0;
}

double cpu_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }
double thread_cpu_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

double scale_for_range(double range) {
  if (!(range > 0) || std::isinf(range)) return kUnlimitedScale;
  return std::max(1.0, std::floor(65534.0 / range));
}

Json json_of(const RunInfo& info) {
  Json json = {{"format", kRunFormat},
               {"version", info.version},
               {"sequence", info.sequence.string()},
               {"poses", info.poses},
               {"options", Json::parse(info.options, nullptr, false)},
               {"camera", json_by(camera_fields, info.camera)},
               {"window", info.window},
               {"range_limit_m", info.range_limit},
               {"health", json_of(info.health)},
               {"world_up", nullptr},
               {"geographic_origin", nullptr},
               {"local_origin_m", {info.local_origin.x(), info.local_origin.y(), info.local_origin.z()}},
               {"map", nullptr},
               {"motion", json_by(motion_fields, info.motion)},
               {"stamp_offset", nullptr},
               {"masked_share", info.masked_share},
               {"hints", list_by(hint_fields, info.hints)},
               {"stacks", info.stacks},
               {"depth_scale", info.depth_scale},
               {"sigma_scale", info.sigma_scale},
               {"bound_scale", info.bound_scale},
               {"states", json_of_states(info.state_pixels)}};
  if (info.world_up) {
    const Eigen::Vector3d& up = info.world_up->direction;
    json["world_up"] = {{"direction", {up.x(), up.y(), up.z()}},
                        {"stated", info.world_up->stated},
                        {"source", info.world_up->source}};
  }
  if (info.origin) json["geographic_origin"] = json_by(origin_fields, *info.origin);
  if (info.motion.stamp_offset) json["stamp_offset"] = json_by(offset_fields, *info.motion.stamp_offset);
  if (info.map) json["map"] = json_by(map_fields, *info.map);
  return json;
}

std::string to_json(const RunInfo& info) {
  return json_of(info).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<RunInfo> run_info_from_json(std::string_view text, std::string_view file) {
  const Result<Json> json = parse(text, file);
  if (!json) return json.error();
  std::optional<Error> error;
  Fields fields(*json, "", file, error);
  std::string format;
  fields.read("format", format, fmt::format("\"{}\"", kRunFormat));
  if (!error && format != kRunFormat) {
    return Error{fmt::format("{}: format: found \"{}\", expected \"{}\"", file, format, kRunFormat)};
  }
  RunInfo info;
  std::string sequence;
  Json options = Json::object();
  fields.read("version", info.version, "text");
  fields.read("sequence", sequence, "a path");
  fields.read("poses", info.poses, "text");
  fields.read("options", options, "an object");
  fields.object("camera").read_all(camera_fields, info.camera);
  fields.read("window", info.window, "a whole number");
  fields.read("range_limit_m", info.range_limit, "metres");
  read_health(fields.object("health"), info.health);
  read_optional_parts(fields, info);
  fields.object("motion").read_all(motion_fields, info.motion);
  fields.read("masked_share", info.masked_share, "a share of the image");
  read_list(fields.list("hints"), hint_fields, info.hints);
  fields.read("stacks", info.stacks, "a list of names");
  fields.read("depth_scale", info.depth_scale, "counts per metre");
  fields.read("sigma_scale", info.sigma_scale, "counts per metre");
  fields.read("bound_scale", info.bound_scale, "counts per metre");
  std::size_t state = 0;
  for (Fields item : fields.list("states")) {
    if (state < info.state_pixels.size()) item.read("pixels", info.state_pixels[state++], "a count");
  }
  if (error) return *error;
  if (!(info.depth_scale > 0) || !(info.sigma_scale > 0) || !(info.bound_scale > 0)) {
    return Error{fmt::format(
        "{}: depth_scale, sigma_scale, bound_scale: found {}, {} and {}, expected positive counts per metre",
        file, info.depth_scale, info.sigma_scale, info.bound_scale)};
  }
  info.sequence = sequence;
  info.options = options.dump();
  return info;
}

Json json_of(const RunTiming& timing) {
  return {{"stages", list_by(stage_fields, timing.stages)},
          {"frames_per_second", timing.frames_per_second},
          {"peak_memory_bytes", timing.peak_memory},
          {"cpu_seconds", timing.cpu_seconds},
          {"stages_cpu_seconds", timing.stages_cpu_seconds}};
}

std::string to_json(const RunTiming& timing) { return json_of(timing).dump(2) + "\n"; }

Result<RunTiming> run_timing_from_json(std::string_view text, std::string_view file) {
  const Result<Json> json = parse(text, file);
  if (!json) return json.error();
  std::optional<Error> error;
  Fields fields(*json, "", file, error);
  RunTiming timing;
  read_list(fields.list("stages"), stage_fields, timing.stages);
  fields.read("frames_per_second", timing.frames_per_second, "a number");
  fields.read("peak_memory_bytes", timing.peak_memory, "bytes");
  if (fields.has("cpu_seconds")) {  // absent in runs of earlier versions
    fields.read("cpu_seconds", timing.cpu_seconds, "seconds");
    fields.read("stages_cpu_seconds", timing.stages_cpu_seconds, "seconds");
  }
  if (error) return *error;
  return timing;
}

}  // namespace pade::io
