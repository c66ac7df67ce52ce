#include "pade/io/run/health_json.hpp"

#include <nlohmann/json.hpp>

#include "pade/io/run/run_fields.hpp"

namespace pade::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto navigation_fields = [](auto& health, auto&& field) {
  auto& filter = health.filter;
  field("status", filter.status, "a status");
  field("frames", health.frames, "a count");
  field("frames_without_answer", health.frames_without_answer, "a count");
  field("frames_lost", health.frames_lost, "a count");
  field("speed_median_m_s", health.speed_median, "m/s");
  field("speed_largest_m_s", health.speed_largest, "m/s");
  field("imu_refused", filter.imu_refused, "a count");
  field("imu_gaps", filter.imu_gaps, "a count");
  field("measurements_too_late", filter.too_late, "a count");
  field("measurements_too_new", filter.too_new, "a count");
  field("measurements_repeated", filter.duplicates, "a count");
  field("measurements_unusable", filter.unusable, "a count");
  field("restarts", filter.restarts, "a count");
  field("restarts_when_lost", filter.restarts_when_lost, "a count");
  field("times_lost", filter.times_lost, "a count");
  field("velocity_doubted", filter.velocity_doubted, "a count");
};
constexpr auto sensor_fields = [](auto& sensor, auto&& field) {
  field("sensor", sensor.sensor, "a name");
  field("measurements", sensor.measurements, "a count");
  field("refused", sensor.refused, "a count");
  field("chi_square_per_component", sensor.chi_square, "a number");
};
constexpr auto run_fields = [](auto& health, auto&& field) {
  field("frames", health.frames, "a whole number");
  field("frames_used", health.frames_used, "a whole number");
  field("depth_images", health.depth_images, "a whole number");
  field("frames_without_pose", health.frames_without_pose, "a whole number");
  field("motions_without_scale", health.motions_without_scale, "a whole number");
};
constexpr auto skipped_fields = [](auto& skipped, auto&& field) {
  field("file", skipped.file, "text");
  field("reason", skipped.reason, "text");
};

}  // namespace

Json json_of(const NavigationHealth& health) {
  Json json = json_by(navigation_fields, health);
  json["magnetometer_doubted"] = health.filter.magnetometer_doubted;
  Json& sensors = json["sensors"] = Json::array();
  for (const navigation::SensorSummary& sensor : health.sensors) {
    sensors.push_back(json_by(sensor_fields, sensor));
  }
  return json;
}

Json json_of(const RunHealth& health) {
  Json json = json_by(run_fields, health);
  Json& skipped = json["skipped"] = Json::array();
  for (const Skipped& item : health.skipped) skipped.push_back(json_by(skipped_fields, item));
  json["warnings"] = health.warnings;
  if (health.navigation) json["navigation"] = json_of(*health.navigation);
  return json;
}

void read_health(RunFields fields, RunHealth& health) {
  fields.read_all(run_fields, health);
  fields.read("warnings", health.warnings, "a list of sentences");
  for (RunFields item : fields.list("skipped")) item.read_all(skipped_fields, health.skipped.emplace_back());
  if (!fields.has("navigation")) return;
  NavigationHealth& navigation = health.navigation.emplace();
  RunFields read = fields.object("navigation");
  read.read_all(navigation_fields, navigation);
  if (read.has("magnetometer_doubted"))  // runs of before have none
    read.read("magnetometer_doubted", navigation.filter.magnetometer_doubted, "a count");
  for (RunFields item : read.list("sensors")) item.read_all(sensor_fields, navigation.sensors.emplace_back());
}

}  // namespace pade::io
