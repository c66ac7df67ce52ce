#include "pade/io/run/run_info.hpp"

#include <algorithm>
#include <cmath>
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

Json json_of(const Camera& camera) {
  return {{"width", camera.width}, {"height", camera.height}, {"fx", camera.fx},
          {"fy", camera.fy},       {"cx", camera.cx},         {"cy", camera.cy}};
}

Json json_of(const MapSummary& map) {
  return {{"voxel_m", map.voxel},
          {"occupied_voxels", map.occupied_voxels},
          {"free_voxels", map.free_voxels},
          {"depths", map.depths},
          {"depths_beyond_range", map.depths_beyond},
          {"depths_uncertain", map.depths_uncertain},
          {"points_outside", map.points_outside},
          {"voxel_hits", map.hits}};
}

Json json_of(const MotionSummary& motion) {
  return {{"pairs", motion.pairs},
          {"still_pairs", motion.still_pairs},
          {"baseline_m", motion.baseline},
          {"rotation_sigma_deg", motion.rotation_sigma},
          {"direction_sigma_deg", motion.direction_sigma}};
}

Json json_of(const std::vector<Hint>& hints) {
  Json list = Json::array();
  for (const Hint& hint : hints) {
    list.push_back({{"id", hint.id},
                    {"severity", to_name(hint.severity)},
                    {"message", hint.message},
                    {"advice", hint.advice}});
  }
  return list;
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

void read_camera(Fields fields, Camera& camera) {
  fields.read("width", camera.width, "pixels");
  fields.read("height", camera.height, "pixels");
  fields.read("fx", camera.fx, "pixels");
  fields.read("fy", camera.fy, "pixels");
  fields.read("cx", camera.cx, "pixels");
  fields.read("cy", camera.cy, "pixels");
}

void read_map(Fields fields, MapSummary& map) {
  fields.read("voxel_m", map.voxel, "metres");
  fields.read("occupied_voxels", map.occupied_voxels, "a count");
  fields.read("free_voxels", map.free_voxels, "a count");
  fields.read("depths", map.depths, "a count");
  fields.read("depths_beyond_range", map.depths_beyond, "a count");
  fields.read("depths_uncertain", map.depths_uncertain, "a count");
  fields.read("points_outside", map.points_outside, "a count");
  fields.read("voxel_hits", map.hits, "a count");
}

void read_motion(Fields fields, MotionSummary& motion) {
  fields.read("pairs", motion.pairs, "a count");
  fields.read("still_pairs", motion.still_pairs, "a count");
  fields.read("baseline_m", motion.baseline, "metres");
  fields.read("rotation_sigma_deg", motion.rotation_sigma, "degrees");
  fields.read("direction_sigma_deg", motion.direction_sigma, "degrees");
}

void read_hints(std::vector<Fields> items, std::vector<Hint>& hints) {
  for (Fields& item : items) {
    Hint hint;
    item.read("id", hint.id, "a name");
    item.read("severity", hint.severity, "warning or error");
    item.read("message", hint.message, "text");
    item.read("advice", hint.advice, "text");
    hints.push_back(std::move(hint));
  }
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
  if (fields.has("geographic_origin")) {
    Fields origin = fields.object("geographic_origin");
    info.origin.emplace();
    origin.read("latitude_deg", info.origin->latitude_deg, "degrees");
    origin.read("longitude_deg", info.origin->longitude_deg, "degrees");
    origin.read("height_m", info.origin->height, "metres");
  }
  if (fields.has("local_origin_m")) {  // absent in runs of earlier versions
    std::vector<double> origin;
    fields.read("local_origin_m", origin, "three numbers");
    if (origin.size() == 3) info.local_origin = Eigen::Vector3d(origin[0], origin[1], origin[2]);
  }
  if (fields.has("map")) {
    info.map.emplace();
    read_map(fields.object("map"), *info.map);
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

double scale_for_range(double range) {
  if (!(range > 0) || std::isinf(range)) return kUnlimitedScale;
  return std::max(1.0, std::floor(65534.0 / range));
}

std::string to_json(const RunInfo& info) {
  Json json = {{"format", kRunFormat},
               {"version", info.version},
               {"sequence", info.sequence.string()},
               {"poses", info.poses},
               {"options", Json::parse(info.options, nullptr, false)},
               {"camera", json_of(info.camera)},
               {"window", info.window},
               {"range_limit_m", info.range_limit},
               {"health", json_of(info.health)},
               {"world_up", nullptr},
               {"geographic_origin", nullptr},
               {"local_origin_m", {info.local_origin.x(), info.local_origin.y(), info.local_origin.z()}},
               {"map", nullptr},
               {"motion", json_of(info.motion)},
               {"masked_share", info.masked_share},
               {"hints", json_of(info.hints)},
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
  if (info.origin) {
    json["geographic_origin"] = {{"latitude_deg", info.origin->latitude_deg},
                                 {"longitude_deg", info.origin->longitude_deg},
                                 {"height_m", info.origin->height}};
  }
  if (info.map) {
    json["map"] = json_of(*info.map);
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
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
  read_camera(fields.object("camera"), info.camera);
  fields.read("window", info.window, "a whole number");
  fields.read("range_limit_m", info.range_limit, "metres");
  read_health(fields.object("health"), info.health);
  read_optional_parts(fields, info);
  read_motion(fields.object("motion"), info.motion);
  fields.read("masked_share", info.masked_share, "a share of the image");
  read_hints(fields.list("hints"), info.hints);
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

std::string to_json(const RunTiming& timing) {
  Json stages = Json::array();
  for (const StageTiming& stage : timing.stages) {
    stages.push_back({{"stage", stage.stage},
                      {"frames", stage.count},
                      {"mean_ms", stage.mean},
                      {"p50_ms", stage.p50},
                      {"p99_ms", stage.p99},
                      {"max_ms", stage.max}});
  }
  const Json json = {{"stages", std::move(stages)},
                     {"frames_per_second", timing.frames_per_second},
                     {"peak_memory_bytes", timing.peak_memory}};
  return json.dump(2) + "\n";
}

Result<RunTiming> run_timing_from_json(std::string_view text, std::string_view file) {
  const Result<Json> json = parse(text, file);
  if (!json) return json.error();
  std::optional<Error> error;
  Fields fields(*json, "", file, error);
  RunTiming timing;
  for (Fields item : fields.list("stages")) {
    StageTiming stage;
    item.read("stage", stage.stage, "text");
    item.read("frames", stage.count, "a count");
    item.read("mean_ms", stage.mean, "milliseconds");
    item.read("p50_ms", stage.p50, "milliseconds");
    item.read("p99_ms", stage.p99, "milliseconds");
    item.read("max_ms", stage.max, "milliseconds");
    timing.stages.push_back(std::move(stage));
  }
  fields.read("frames_per_second", timing.frames_per_second, "a number");
  fields.read("peak_memory_bytes", timing.peak_memory, "bytes");
  if (error) return *error;
  return timing;
}

}  // namespace pade::io
