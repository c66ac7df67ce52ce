// What the innovations and the health of a run say.
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "pade/navigation/plausibility/plausibility.hpp"

namespace pade::navigation {
namespace {

void say(std::vector<Hint>& hints, std::string id, HintSeverity severity, std::string message,
         std::string advice) {
  hints.push_back({std::move(id), severity, std::move(message), std::move(advice)});
}

const char* name_of(SensorKind kind) {
  switch (kind) {
    case SensorKind::gnss_velocity:
      return "gnss_velocity";
    case SensorKind::gnss_position:
      return "gnss_position";
    case SensorKind::barometer:
      return "barometer";
    case SensorKind::heading:
      return "heading";
    case SensorKind::magnetometer:
      return "magnetometer";
    case SensorKind::zero_velocity:
      return "zero_velocity";
    case SensorKind::range:
      return "range";
    case SensorKind::road:
      return "road";
    case SensorKind::raw_gnss:
      return "raw_gnss";
    case SensorKind::camera:
      return "camera";
  }
  return "";
}

/// What the filter found out about itself.
void check_integrity(const Health& health, std::vector<Hint>& hints) {
  const std::uint64_t gaps = health.restarts - health.restarts_when_lost;
  if (gaps > 0) {
    say(hints, "restarts", HintSeverity::warning,
        fmt::format("the filter had to start anew {} times: the IMU log has gaps that cannot be bridged",
                    gaps),
        "record without gaps of more than 3 s");
  }
  if (health.times_lost > 0) {
    say(hints, "lost", HintSeverity::warning,
        fmt::format("the filter was lost {} times (its innovations refuted its covariance) and had to start "
                    "anew {} times because of it; then no length and no direction is called valid",
                    health.times_lost, health.restarts_when_lost),
        "see the times of status `lost` in relative_motion.csv: an instrument that jumps, knocks, another "
        "class of IMU (--imu), a latency");
  }
  if (health.velocity_doubted > 0) {
    say(hints, "velocity-doubted", HintSeverity::warning,
        fmt::format("the velocities of the GNSS contradicted its positions {} times and were not used until "
                    "they agreed again",
                    health.velocity_doubted),
        "check axes and unit of the velocities, and what the receiver says of their quality");
  }
  if (health.magnetometer_doubted > 0) {
    say(hints, "magnetometer-doubted", HintSeverity::warning,
        fmt::format("the magnetometer contradicted the yaw that GNSS velocities and inertial sensors show {} "
                    "times and was not used until it agreed again",
                    health.magnetometer_doubted),
        "calibrate the compass, away from steel and currents; check axes and --declination");
  }
}

}  // namespace

std::vector<SensorSummary> summarise(std::span<const Measurement> measurements) {
  std::array<SensorSummary, sensor_kinds> sums;
  std::array<double, sensor_kinds> freedom{};
  for (const Measurement& m : measurements) {
    if (m.innovation.verdict == Verdict::unusable) continue;
    const auto kind = m.value.index();
    SensorSummary& sum = sums[kind];
    ++sum.measurements;
    if (m.innovation.verdict == Verdict::rejected || m.innovation.verdict == Verdict::reacquired)
      ++sum.refused;
    sum.chi_square += m.innovation.chi_square;
    freedom[kind] += m.innovation.size;
  }
  std::vector<SensorSummary> out;
  for (std::size_t kind = 0; kind < sums.size(); ++kind) {
    if (sums[kind].measurements == 0) continue;
    sums[kind].sensor = name_of(static_cast<SensorKind>(kind));
    sums[kind].chi_square /= std::max(freedom[kind], 1.0);
    out.push_back(sums[kind]);
  }
  return out;
}

std::vector<Hint> check_run(std::span<const SensorSummary> sensors, const Health& health,
                            std::size_t imu_samples) {
  std::vector<Hint> hints;
  constexpr double kSomeRefused = 0.05;
  const double refused_imu =
      imu_samples > 0 ? static_cast<double>(health.imu_refused) / static_cast<double>(imu_samples) : 0;
  if (refused_imu > kSomeRefused) {
    say(hints, "imu-refused", refused_imu > 0.3 ? HintSeverity::error : HintSeverity::warning,
        fmt::format("{:.0f} % of the IMU samples were refused: not later than the one before, or not finite",
                    100 * refused_imu),
        "look at the stamps of imu.csv: they must rise");
  }
  for (const SensorSummary& sensor : sensors) {
    if (sensor.measurements < 10) continue;
    const double refused = static_cast<double>(sensor.refused) / static_cast<double>(sensor.measurements);
    const bool is_barometer = sensor.sensor == "barometer";
    const char* const of_barometer =
        "check that height_m is in metres and up; leave baro.csv out where it disturbs";
    constexpr double kMostRefused = 0.3;
    constexpr double kInconsistent = 10;  // times what the sigmas allow
    if (refused > kMostRefused) {
      say(hints, "sensor-refused", HintSeverity::error,
          fmt::format(
              "{:.0f} % of {} were refused by the filter (mean χ² {:.3g} per component, 1 is consistent)",
              100 * refused, sensor.sensor, sensor.chi_square),
          is_barometer
              ? of_barometer
              : "check clock, axes, units and sigmas of this sensor, and the lever arm (--lever-arm)");
    } else if (sensor.chi_square > kInconsistent) {
      // A barometer that is used although it is wrong bends the height.
      say(hints, "inconsistent", is_barometer ? HintSeverity::error : HintSeverity::warning,
          fmt::format("{} disagree with the filter: mean χ² {:.3g} per component where 1 is consistent",
                      sensor.sensor, sensor.chi_square),
          is_barometer
              ? of_barometer
              : "check clock, axes and units of this sensor; sigmas that are too small look like this too");
    }
  }
  check_integrity(health, hints);
  std::uint64_t judged = 0;
  for (const SensorSummary& sensor : sensors) judged += sensor.measurements;
  constexpr double kSomeUnused = 0.02;
  const auto many = [&](std::uint64_t unused) {
    return unused > 10 && static_cast<double>(unused) > kSomeUnused * static_cast<double>(judged + unused);
  };
  if (many(health.too_late)) {
    say(hints, "measurements-too-late", HintSeverity::warning,
        fmt::format("{} measurements came after the filter had gone on too far to use them ({} were used)",
                    health.too_late, judged),
        "check the clocks of the sensors against that of the IMU, and the latencies that are given");
  }
  if (many(health.too_new)) {
    say(hints, "measurements-too-new", HintSeverity::warning,
        fmt::format(
            "{} measurements have stamps of many seconds after the IMU and were not used ({} were used)",
            health.too_new, judged),
        "check the clocks of the sensors against that of the IMU");
  }
  return hints;
}

}  // namespace pade::navigation
