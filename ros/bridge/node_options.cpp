#include "node_options.hpp"

#include <cmath>
#include <map>
#include <memory>
#include <sstream>

#include <fmt/format.h>
#include <pade/io/options_json.hpp>

namespace pade_ros {
namespace {

/// Parameters by their levels.
struct Level {
  std::string value;
  std::map<std::string, Level> fields;
};

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') out += '\\';
    out += letter;
  }
  return out + '"';
}

/// As YAML of one line. Numbers and words stand as they are, other texts in quotes.
std::string yaml_of(const Level& level) {
  if (level.fields.empty()) {
    const bool plain =
        !level.value.empty() &&
        level.value.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+-._") ==
            std::string::npos;
    return plain ? level.value : quoted(level.value);
  }
  std::string text = "{";
  for (const auto& [name, field] : level.fields)
    text += fmt::format("{}{}: {}", text.size() > 1 ? ", " : "", quoted(name), yaml_of(field));
  return text + "}";
}

bool within(double value, double least, double most) { return value >= least && value <= most; }

}  // namespace

pade::Status check(const NodeOptions& options) {
  struct Range {
    const char* name;
    double value, least, most;
  };
  const Range ranges[] = {
      {"max_wait_for_pose", options.max_wait_for_pose, 0, 60},
      {"most_waiting", static_cast<double>(options.most_waiting), 1, 1000},
      {"max_latency", options.max_latency, 0, 60},
      {"time_offset", options.time_offset, -1, 1},
      {"velocity_sigma", options.velocity_sigma, 0, 100},
      {"rotation_sigma", options.rotation_sigma, 0, 1},
      {"least_depth", options.least_depth, 0, 1},
      {"cloud_step", static_cast<double>(options.cloud_step), 1, 64},
      {"map_rate", options.map_rate, 0.01, 30},
  };
  for (const Range& range : ranges) {
    if (!within(range.value, range.least, range.most))
      return pade::Error{fmt::format("option {} is {}, expected {} to {}", range.name, range.value,
                                     range.least, range.most)};
  }
  if (!(options.occupancy_min_z < options.occupancy_max_z)) {
    return pade::Error{fmt::format("option occupancy_min_z is {}, expected less than occupancy_max_z, {}",
                                   options.occupancy_min_z, options.occupancy_max_z)};
  }
  if (options.map_frame.empty())
    return pade::Error{"option map_frame is empty, expected the name of a frame that nobody else publishes"};
  if (!options.map_file.ends_with(".bt") && !options.map_file.ends_with(".ot"))
    return pade::Error{
        fmt::format("option map_file is \"{}\", expected a name that ends in .bt or .ot", options.map_file)};
  if (!options.mounting.empty()) {
    if (const auto pose = read_mounting(options.mounting); !pose) return pose.error();
  }
  if (pade::Status status = pade::navigation::check(options.navigator); !status)
    return pade::Error{"navigator: " + status.error().message};
  if (pade::Status status = pade::check(options.mapper); !status)
    return pade::Error{"mapper: " + status.error().message};
  return {};
}

pade::Result<pade::Pose> read_mounting(const std::string& text) {
  std::istringstream words(text);
  std::array<double, 7> v{};
  for (double& value : v) words >> value;
  std::string rest;
  const double norm = std::hypot(std::hypot(v[3], v[4]), std::hypot(v[5], v[6]));
  if (!words || words >> rest || !(std::abs(norm - 1) < 0.01)) {
    return pade::Error{fmt::format(
        "option mounting is \"{}\", expected seven numbers, x y z qx qy qz qw, with a unit quaternion",
        text)};
  }
  return pade::Pose{Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized(), {v[0], v[1], v[2]}};
}

pade::Result<NodeOptions> read_parameters(const Parameters& parameters) {
  Level root;
  for (const auto& [path, value] : parameters) {
    Level* level = &root;
    std::istringstream names(path);
    for (std::string name; std::getline(names, name, '.');) level = &level->fields[name];
    level->value = value;
  }
  NodeOptions options;
  if (root.fields.empty()) return options;
  if (pade::Status status = pade::io::from_yaml(yaml_of(root), "parameters", options); !status)
    return status.error();
  return options;
}

bool read_settings(const Parameters& parameters, Settings& settings, std::string& error) {
  const auto options = read_parameters(parameters);
  if (!options) {
    error = options.error().message;
    return false;
  }
  settings.poses = std::string(pade::to_name(options->poses));
  settings.compressed = options->compressed;
  settings.publish_tf = options->publish_tf && options->poses == PoseKind::sensors;
  settings.save_on_exit = options->save_on_exit;
  return true;
}

}  // namespace pade_ros
