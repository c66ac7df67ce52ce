#include "pade/io/run/health_json.hpp"

#include <nlohmann/json.hpp>

#include "pade/io/run/run_fields.hpp"

namespace pade::io {

namespace {
using Json = nlohmann::ordered_json;
}  // namespace

Json json_of(const NavigationHealth& health) {
  const navigation::Health& filter = health.filter;
  Json sensors = Json::array();
  for (const navigation::SensorSummary& sensor : health.sensors) {
    sensors.push_back({{"sensor", sensor.sensor},
                       {"measurements", sensor.measurements},
                       {"refused", sensor.refused},
                       {"chi_square_per_component", sensor.chi_square}});
  }
  return {{"status", to_name(filter.status)},
          {"frames", health.frames},
          {"frames_without_answer", health.frames_without_answer},
          {"frames_lost", health.frames_lost},
          {"speed_median_m_s", health.speed_median},
          {"speed_largest_m_s", health.speed_largest},
          {"imu_refused", filter.imu_refused},
          {"imu_gaps", filter.imu_gaps},
          {"measurements_too_late", filter.too_late},
          {"measurements_repeated", filter.duplicates},
          {"measurements_unusable", filter.unusable},
          {"restarts", filter.restarts},
          {"restarts_when_lost", filter.restarts_when_lost},
          {"times_lost", filter.times_lost},
          {"velocity_doubted", filter.velocity_doubted},
          {"sensors", std::move(sensors)}};
}

Json json_of(const RunHealth& health) {
  Json skipped = Json::array();
  for (const Skipped& item : health.skipped)
    skipped.push_back({{"file", item.file}, {"reason", item.reason}});
  Json json = {{"frames", health.frames},
               {"frames_used", health.frames_used},
               {"depth_images", health.depth_images},
               {"frames_without_pose", health.frames_without_pose},
               {"motions_without_scale", health.motions_without_scale},
               {"skipped", std::move(skipped)},
               {"warnings", health.warnings}};
  if (health.navigation) json["navigation"] = json_of(*health.navigation);
  return json;
}

namespace {

void read_navigation(RunFields fields, NavigationHealth& health) {
  navigation::Health& filter = health.filter;
  fields.read("status", filter.status, "a status");
  fields.read("frames", health.frames, "a count");
  fields.read("frames_without_answer", health.frames_without_answer, "a count");
  fields.read("frames_lost", health.frames_lost, "a count");
  fields.read("speed_median_m_s", health.speed_median, "m/s");
  fields.read("speed_largest_m_s", health.speed_largest, "m/s");
  fields.read("imu_refused", filter.imu_refused, "a count");
  fields.read("imu_gaps", filter.imu_gaps, "a count");
  fields.read("measurements_too_late", filter.too_late, "a count");
  fields.read("measurements_repeated", filter.duplicates, "a count");
  fields.read("measurements_unusable", filter.unusable, "a count");
  fields.read("restarts", filter.restarts, "a count");
  fields.read("restarts_when_lost", filter.restarts_when_lost, "a count");
  fields.read("times_lost", filter.times_lost, "a count");
  fields.read("velocity_doubted", filter.velocity_doubted, "a count");
  for (RunFields item : fields.list("sensors")) {
    navigation::SensorSummary sensor;
    item.read("sensor", sensor.sensor, "a name");
    item.read("measurements", sensor.measurements, "a count");
    item.read("refused", sensor.refused, "a count");
    item.read("chi_square_per_component", sensor.chi_square, "a number");
    health.sensors.push_back(std::move(sensor));
  }
}

}  // namespace

void read_health(RunFields fields, RunHealth& health) {
  fields.read("frames", health.frames, "a whole number");
  fields.read("frames_used", health.frames_used, "a whole number");
  fields.read("depth_images", health.depth_images, "a whole number");
  fields.read("frames_without_pose", health.frames_without_pose, "a whole number");
  fields.read("motions_without_scale", health.motions_without_scale, "a whole number");
  fields.read("warnings", health.warnings, "a list of sentences");
  for (RunFields item : fields.list("skipped")) {
    Skipped skipped;
    item.read("file", skipped.file, "text");
    item.read("reason", skipped.reason, "text");
    health.skipped.push_back(std::move(skipped));
  }
  if (!fields.has("navigation")) return;
  health.navigation.emplace();
  read_navigation(fields.object("navigation"), *health.navigation);
}

}  // namespace pade::io
