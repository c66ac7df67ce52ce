#include "pade/simulation/flight/flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "pade/core/option_check.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/text.hpp"
#include "pade/io/yaml.hpp"

namespace pade::simulation {

Status check(const SensorOptions& options) {
  const std::array<OptionRange, 5> ranges = {{{"imu_rate", options.imu_rate, 1, 10000},
                                              {"gnss_rate", options.gnss_rate, 0.1, 1000},
                                              {"gnss_latency", options.gnss_latency, 0, 10},
                                              {"baro_rate", options.baro_rate, 0.1, 1000},
                                              {"mag_rate", options.mag_rate, 0.1, 1000}}};
  return pade::check_ranges(ranges);
}

namespace {

using io::Yaml;

constexpr double kRadians = std::numbers::pi / 180;

struct SwingFile {
  double amplitude_deg = 0;
  double period_s = 4;
  double phase_deg = 0;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("amplitude_deg", self.amplitude_deg, "");
    field("period_s", self.period_s, "");
    field("phase_deg", self.phase_deg, "");
  }
  [[nodiscard]] Oscillation in_radians() const {
    return {amplitude_deg * kRadians, period_s, phase_deg * kRadians};
  }
};

struct LimitsFile {
  double speed = FlightLimits{}.speed;
  double acceleration = FlightLimits{}.acceleration;
  double tilt_deg = FlightLimits{}.tilt / kRadians;
  double angular_rate_deg_s = FlightLimits{}.angular_rate / kRadians;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("speed", self.speed, "");
    field("acceleration", self.acceleration, "");
    field("tilt_deg", self.tilt_deg, "");
    field("angular_rate_deg_s", self.angular_rate_deg_s, "");
  }
};

/// The fields of the file that are single values, with the units that people write.
struct FlightFile {
  std::string name;
  double speed = TrajectoryOptions{}.speed;
  Heading heading = Heading::waypoint;
  PathEnd start = PathEnd::moving;
  PathEnd end = PathEnd::moving;
  double drag = 0;
  SwingFile roll, pitch, yaw;
  LimitsFile limits;
  double frame_rate = Flight{}.frame_rate;
  double first_frame_s = Flight{}.first_frame;
  int frames = 0;
  double exposure_time_s = 0;
  int blur_samples = Flight{}.blur_samples;
  ImageOptions image;
  SensorOptions sensors;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("name", self.name, "");
    field("speed", self.speed, "");
    field("heading", self.heading, "");
    field("start", self.start, "");
    field("end", self.end, "");
    field("drag", self.drag, "");
    field("roll", self.roll, "");
    field("pitch", self.pitch, "");
    field("yaw", self.yaw, "");
    field("limits", self.limits, "");
    field("frame_rate", self.frame_rate, "");
    field("first_frame_s", self.first_frame_s, "");
    field("frames", self.frames, "");
    field("exposure_time_s", self.exposure_time_s, "");
    field("blur_samples", self.blur_samples, "");
    field("image", self.image, "");
    field("sensors", self.sensors, "");
  }
};

Error at_field(const std::string& file, const Yaml& node, std::string_view field, std::string_view expected) {
  return {fmt::format("{}:{}: field {}: found {}, expected {}", file, node.line, field, io::described(node),
                      expected)};
}

/// Sets one field; empty where that went well.
std::optional<std::string> set_field(const Yaml& node, const io::OptionField& field) {
  if (const auto* flag = std::get_if<bool*>(&field.value)) {
    if (node.scalar != "true" && node.scalar != "false") return "true or false";
    **flag = node.scalar == "true";
  } else if (const auto* text = std::get_if<std::string*>(&field.value)) {
    **text = node.scalar;
  } else if (const auto* choice = std::get_if<io::EnumField>(&field.value)) {
    if (!choice->set(node.scalar)) {
      std::string names;
      for (const std::string_view name : choice->names)
        names += fmt::format("{}{}", names.empty() ? "one of " : ", ", name);
      return names;
    }
  } else {
    const auto number = io::parse_number(node.scalar);
    if (!number || !std::isfinite(*number)) return "a finite number";
    if (const auto* real = std::get_if<double*>(&field.value)) {
      **real = *number;
    } else if (const auto* whole = std::get_if<int*>(&field.value)) {
      if (*number != std::floor(*number) || std::abs(*number) > 1e9) return "a whole number";
      **whole = static_cast<int>(*number);
    }
  }
  return std::nullopt;
}

/// Sets the fields that a map names, except `others`, which are read elsewhere.
Status set_fields(const Yaml& map, const std::string& file, const std::string& prefix,
                  const io::OptionFields& fields, std::initializer_list<std::string_view> others = {}) {
  if (map.kind != Yaml::Kind::map)
    return at_field(file, map, prefix.empty() ? "(all)" : prefix, "a list of fields with values");
  for (const auto& [key, node] : map.map) {
    if (std::find(others.begin(), others.end(), key) != others.end()) continue;
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    const auto field =
        std::find_if(fields.begin(), fields.end(), [&key = key](const auto& f) { return f.name == key; });
    if (field == fields.end())
      return Error{fmt::format("{}:{}: field {} is unknown", file, node.line, io::in_quotes(name))};
    if (const auto* nested = std::get_if<io::OptionFields>(&field->value)) {
      if (const Status status = set_fields(node, file, name, *nested); !status) return status;
      continue;
    }
    if (node.kind != Yaml::Kind::scalar) return at_field(file, node, name, "a single value");
    if (const auto expected = set_field(node, *field)) return at_field(file, node, name, *expected);
  }
  return {};
}

Status in_range(const std::string& file, std::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return Error{fmt::format("{}: field {}: found {}, expected {} to {}", file, field, value, low, high)};
}

Status check_ranges(const std::string& file, const FlightFile& f) {
  struct Range {
    std::string_view field;
    double value, low, high;
  };
  constexpr double kTiny = 1e-9;
  const Range ranges[] = {{"speed", f.speed, 1e-3, 100},
                          {"drag", f.drag, 0, 10},
                          {"frame_rate", f.frame_rate, 1e-2, 1000},
                          {"first_frame_s", f.first_frame_s, 0, 1e5},
                          {"frames", static_cast<double>(f.frames), 0, 1e6},
                          {"exposure_time_s", f.exposure_time_s, 0, 1},
                          {"blur_samples", static_cast<double>(f.blur_samples), 1, 256},
                          {"roll.period_s", f.roll.period_s, 0.01, 1e5},
                          {"pitch.period_s", f.pitch.period_s, 0.01, 1e5},
                          {"yaw.period_s", f.yaw.period_s, 0.01, 1e5},
                          {"limits.speed", f.limits.speed, kTiny, 1e3},
                          {"limits.acceleration", f.limits.acceleration, kTiny, 1e3},
                          {"limits.tilt_deg", f.limits.tilt_deg, 0, 180},
                          {"limits.angular_rate_deg_s", f.limits.angular_rate_deg_s, kTiny, 1e5}};
  for (const Range& r : ranges) {
    if (const Status status = in_range(file, r.field, r.value, r.low, r.high); !status) return status;
  }
  for (const Status& status : {within("image", check(f.image)), within("sensors", check(f.sensors))}) {
    if (!status) return Error{fmt::format("{}: {}", file, status.error().message)};
  }
  return {};
}

Result<Waypoint> waypoint(const Yaml& node, const std::string& file, std::size_t index) {
  const std::string name = fmt::format("waypoints[{}]", index + 1);
  if (node.kind != Yaml::Kind::map) return at_field(file, node, name, "{position: [x, y, z], yaw_deg: a}");
  io::CalibrationFields fields(node, file);
  Waypoint point;
  fields.require({"position"}, "[x, y, z] in metres");
  if (const auto p = fields.numbers({"position"}, "[x, y, z] in metres")) {
    if (p->size() != 3) {
      fields.wrong(*fields.find({"position"}), name + ".position", "three numbers in metres");
    } else {
      point.position = {(*p)[0], (*p)[1], (*p)[2]};
    }
  }
  point.yaw = fields.number("yaw_deg").value_or(0) * kRadians;
  point.time = fields.number("time_s");
  if (!fields.unused().empty()) {
    return Error{fmt::format("{}:{}: field {} of {} is unknown", file, node.line,
                             io::in_quotes(fields.unused()[0]), name)};
  }
  if (fields.error()) return *fields.error();
  return point;
}

Status read_camera(const Yaml& node, const std::string& file, Flight& flight) {
  if (node.kind != Yaml::Kind::map) return at_field(file, node, "camera", "width, height, fx, fy, cx, cy");
  io::CalibrationFields fields(node, file);
  Camera camera;
  constexpr int kLargest = 16384;
  camera.width = fields.pixels({"width"}, "the width in pixels").value_or(640);
  camera.height = fields.pixels({"height"}, "the height in pixels").value_or(480);
  camera.fx = fields.positive("fx", "the focal length in pixels").value_or(554.26);
  camera.fy = fields.positive("fy", "the focal length in pixels").value_or(camera.fx);
  camera.cx = fields.number("cx").value_or(0.5 * (camera.width - 1));
  camera.cy = fields.number("cy").value_or(0.5 * (camera.height - 1));
  const auto model = fields.text("distortion_model", "the name of a lens model").value_or("none");
  const auto coefficients =
      fields.numbers({"distortion"}, "a list of numbers").value_or(std::vector<double>{});
  if (const auto wrong = io::set_distortion(camera, model, coefficients)) {
    return Error{fmt::format("{}:{}: field camera.distortion: {}", file, node.line, *wrong)};
  }
  const auto pitch = fields.number("pitch_down_deg");
  const auto mount = fields.transform("T_body_camera");
  if (!fields.unused().empty()) {
    return Error{fmt::format("{}:{}: field {} of camera is unknown", file, node.line,
                             io::in_quotes(fields.unused()[0]))};
  }
  if (fields.error()) return *fields.error();
  if (camera.width < 2 || camera.height < 2 || camera.width > kLargest || camera.height > kLargest) {
    return Error{fmt::format("{}:{}: field camera: found {} x {} pixels, expected 2 to {}", file, node.line,
                             camera.width, camera.height, kLargest)};
  }
  const auto states = [&](const char* name) { return node.find(name) != nullptr; };
  const bool lens = states("distortion_model") || states("distortion");
  flight.stated_camera = {states("width"), states("height"), states("fx"), states("fy"),
                          states("cx"),    states("cy"),     lens};
  const StatedCamera& stated = flight.stated_camera;
  if (stated.width || stated.height || stated.fx || stated.fy || stated.cx || stated.cy || lens)
    flight.camera = camera;
  flight.T_body_camera = mount;
  if (pitch) flight.pitch_down = *pitch * kRadians;
  return {};
}

Flight from_file(const FlightFile& f) {
  Flight flight;
  flight.name = f.name;
  TrajectoryOptions& path = flight.trajectory;
  path.speed = f.speed;
  path.heading = f.heading;
  path.start = f.start;
  path.end = f.end;
  path.drag = f.drag;
  path.roll = f.roll.in_radians();
  path.pitch = f.pitch.in_radians();
  path.yaw = f.yaw.in_radians();
  path.limits = {f.limits.speed, f.limits.acceleration, f.limits.tilt_deg * kRadians,
                 f.limits.angular_rate_deg_s * kRadians};
  flight.frame_rate = f.frame_rate;
  flight.first_frame = f.first_frame_s;
  flight.frames = f.frames;
  flight.exposure_time = f.exposure_time_s;
  flight.blur_samples = f.blur_samples;
  flight.image = f.image;
  flight.sensors = f.sensors;
  return flight;
}

}  // namespace

Result<Flight> read_flight(const std::filesystem::path& file) {
  const auto text = io::read_file(file);
  if (!text) return text.error();
  auto flight = parse_flight(*text, file.string());
  if (flight && flight->name.empty()) flight->name = file.stem().string();
  return flight;
}

Result<Flight> parse_flight(std::string_view text, const std::string& file) {
  const auto root = io::parse_yaml(text, file);
  if (!root) return root.error();
  FlightFile values;
  if (const Status s = set_fields(*root, file, "", io::option_fields(values), {"waypoints", "camera"}); !s)
    return s.error();
  if (const Status s = check_ranges(file, values); !s) return s.error();
  Flight flight = from_file(values);
  const Yaml* points = root->find("waypoints");
  if (points == nullptr || points->kind != Yaml::Kind::list) {
    return Error{fmt::format("{}: field waypoints: found {}, expected a list of at least two waypoints", file,
                             points == nullptr ? "nothing" : io::described(*points))};
  }
  for (std::size_t i = 0; i < points->list.size(); ++i) {
    auto point = waypoint(points->list[i], file, i);
    if (!point) return point.error();
    flight.waypoints.push_back(*point);
  }
  if (const Yaml* image = root->find("image")) {
    flight.states_colour = image->find("colour") != nullptr;
    flight.states_read_noise = image->find("read_noise") != nullptr;
  }
  if (const Yaml* camera = root->find("camera")) {
    if (const Status s = read_camera(*camera, file, flight); !s) return s.error();
  }
  return flight;
}

Pose camera_pose_at(const Trajectory& path, double time, const Pose& T_body_camera) {
  const KinematicState state = path.at(time);
  return camera_pose({state.R_world_body, state.position}, T_body_camera);
}

Result<std::vector<CameraStation>> camera_stations(const Flight& flight, const Trajectory& path,
                                                   const Pose& T_body_camera) {
  const double half_exposure = 0.5 * flight.exposure_time;
  // Frames count from the first so that stamps are the same numbers in every flight.
  const double available = path.duration() - flight.first_frame - half_exposure;
  const int fitting =
      available < 0 ? 0 : static_cast<int>(std::floor(available * flight.frame_rate + 1e-9)) + 1;
  if (flight.first_frame < half_exposure) {
    return Error{
        fmt::format("flight '{}': field first_frame_s: found {}, expected at least half the exposure, {} s",
                    flight.name, flight.first_frame, half_exposure)};
  }
  if (fitting < 2 || flight.frames > fitting) {
    return Error{fmt::format(
        "flight '{}': found waypoints for {:.2f} s, which hold {} frames at {} Hz after the first {} s, "
        "expected {}; add waypoints or fly slower",
        flight.name, path.duration(), fitting, flight.frame_rate, flight.first_frame,
        flight.frames > 0 ? fmt::format("{} frames", flight.frames) : "at least 2 frames")};
  }
  std::vector<CameraStation> stations;
  for (int i = 0; i < (flight.frames > 0 ? flight.frames : fitting); ++i) {
    const double time = flight.first_frame + i / flight.frame_rate;
    stations.push_back({Time::from_seconds(time), camera_pose_at(path, time, T_body_camera)});
  }
  return stations;
}

}  // namespace pade::simulation
