// PX4's topics as measurements.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/text.hpp"
#include "pade/live/recordings/ulog.hpp"

namespace pade::live {
namespace {

using Eigen::Vector3d;
using Column = std::vector<double>;

/// Columns of a topic by name; those that it lacks are NaN.
class Columns {
 public:
  Columns(const Ulog& log, const Ulog::Topic& topic) : log_(log), topic_(topic) {}
  [[nodiscard]] Column get(std::string_view name) const {
    return log_.column(topic_, name).value_or(Column(topic_.rows.size(), std::nan("")));
  }
  [[nodiscard]] bool has(std::string_view name) const { return log_.column(topic_, name).has_value(); }
  [[nodiscard]] std::array<Column, 3> triple(const std::string& name) const {
    return {get(name + "[0]"), get(name + "[1]"), get(name + "[2]")};
  }
  [[nodiscard]] std::size_t rows() const { return topic_.rows.size(); }
  /// When it was measured, where the topic says so, else when it was published, µs.
  [[nodiscard]] Column times() const {
    Column sampled = get("timestamp_sample");
    const Column published = get("timestamp");
    for (std::size_t i = 0; i < sampled.size(); ++i) {
      if (!(sampled[i] > 0)) sampled[i] = published[i];
    }
    return sampled;
  }

 private:
  const Ulog& log_;
  const Ulog::Topic& topic_;
};

/// Empty for a stamp that is none.
std::optional<Time> time_of_microseconds(double microseconds) {
  constexpr double kLast = 4.6e15;  // the year 2115
  if (!(microseconds >= 0 && microseconds < kLast)) return std::nullopt;
  return Time{std::llround(microseconds) * 1000};
}

Vector3d flu_of(const std::array<Column, 3>& frd, std::size_t row) {
  return {frd[0][row], -frd[1][row], -frd[2][row]};
}

std::vector<ImuSample> imu_of(const Columns& columns) {
  std::vector<ImuSample> samples;
  const Column times = columns.times();
  const auto rates = columns.triple("gyro_rad");
  const auto forces = columns.triple("accelerometer_m_s2");
  for (std::size_t i = 0; i < columns.rows(); ++i) {
    const auto time = time_of_microseconds(times[i]);
    const ImuSample sample{time.value_or(Time{}), flu_of(rates, i), flu_of(forces, i)};
    if (time && sample.angular_rate.allFinite() && sample.specific_force.allFinite())
      samples.push_back(sample);
  }
  return samples;
}

std::vector<io::GeodeticFix> fixes_of(const Columns& columns) {
  constexpr double kThreeDimensions = 3;
  const bool degrees = columns.has("latitude_deg");  // since PX4 1.15
  const double angle = degrees ? 1 : 1e-7;
  const double length = degrees ? 1 : 1e-3;
  const Column latitudes = columns.get(degrees ? "latitude_deg" : "lat");
  const Column longitudes = columns.get(degrees ? "longitude_deg" : "lon");
  const Column heights = columns.get(degrees ? "altitude_msl_m" : "alt");
  const Column times = columns.times(), kinds = columns.get("fix_type"), valid = columns.get("vel_ned_valid");
  const Column across = columns.get("eph"), up = columns.get("epv"), speed = columns.get("s_variance_m_s");
  const Column north = columns.get("vel_n_m_s"), east = columns.get("vel_e_m_s"),
               down = columns.get("vel_d_m_s");
  std::vector<io::GeodeticFix> fixes;
  for (std::size_t i = 0; i < columns.rows(); ++i) {
    const auto time = time_of_microseconds(times[i]);
    io::GeodeticFix fix{time.value_or(Time{}),
                        angle * latitudes[i],
                        angle * longitudes[i],
                        length * heights[i],
                        across[i],
                        up[i],
                        {},
                        speed[i]};
    const bool on_earth =
        std::abs(fix.latitude) <= 90 && std::abs(fix.longitude) <= 180 && std::isfinite(fix.height);
    if (!time || !on_earth || !(kinds[i] >= kThreeDimensions)) continue;
    if (!fixes.empty() && fixes.back().time == fix.time) continue;
    const Vector3d velocity(east[i], north[i], -down[i]);
    if (valid[i] > 0 && velocity.allFinite()) fix.velocity = velocity;
    fixes.push_back(fix);
  }
  return fixes;
}

std::vector<MagneticField> fields_of(const Columns& columns) {
  constexpr double kSigma = 0.05;  // as io::parse_magnetometer has it
  std::vector<MagneticField> samples;
  const Column times = columns.times();
  const auto fields = columns.triple("magnetometer_ga");
  for (std::size_t i = 0; i < columns.rows(); ++i) {
    const auto time = time_of_microseconds(times[i]);
    const Vector3d field = flu_of(fields, i);
    if (time && field.allFinite()) samples.push_back({*time, field, kSigma});
  }
  return samples;
}

std::vector<BarometricHeight> heights_of(const Columns& columns) {
  constexpr double kSigma = 0.3;  // m, as io::parse_barometer has it
  std::vector<BarometricHeight> samples;
  const Column times = columns.times();
  const Column heights = columns.get("baro_alt_meter");
  for (std::size_t i = 0; i < columns.rows(); ++i) {
    const auto time = time_of_microseconds(times[i]);
    if (time && std::isfinite(heights[i])) samples.push_back({*time, heights[i], kSigma});
  }
  return samples;
}

}  // namespace

Result<NavigationLog> read_ulog_sensors(const std::filesystem::path& file, SensorNeed need) {
  auto bytes = io::read_file(file);
  if (!bytes) return bytes.error();
  const auto ulog = Ulog::parse(std::move(*bytes), file.string());
  if (!ulog) return ulog.error();
  NavigationLog log;
  log.remarks = ulog->remarks();
  if (const auto* const topic = ulog->find("sensor_combined")) log.imu = imu_of({*ulog, *topic});
  const std::string damage = log.remarks.empty() ? "" : "; " + log.remarks.front();
  if (log.imu.empty()) {
    return Error{fmt::format("{}: the IMU is missing: found no usable sensor_combined among its {} topics{}",
                             file.string(), ulog->topics().size(), damage)};
  }
  std::vector<io::GeodeticFix> fixes;
  for (const char* const name : {"vehicle_gps_position", "sensor_gps"}) {
    const auto* const topic = ulog->find(name);
    if (topic == nullptr || !fixes.empty()) continue;
    fixes = fixes_of({*ulog, *topic});
    if (!fixes.empty()) log.gnss = io::local_log(fixes, name, log.remarks);
  }
  if (fixes.empty()) {
    std::string missing = fmt::format(
        "{}: the GNSS is missing: found no vehicle_gps_position or sensor_gps with a fix in "
        "three dimensions{}",
        file.string(), damage);
    if (need == SensorNeed::imu_and_gnss) return Error{missing};
    log.remarks.push_back(std::move(missing));
  }
  if (const auto* const topic = ulog->find("vehicle_magnetometer"))
    log.magnetometer = fields_of({*ulog, *topic});
  if (const auto* const topic = ulog->find("vehicle_air_data")) log.barometer = heights_of({*ulog, *topic});
  return log;
}

}  // namespace pade::live
