#include "pade/navigation/replay.hpp"

#include <algorithm>

#include "pade/core/random.hpp"

namespace pade::navigation {
namespace {

enum class Kind : std::uint8_t { heading, velocity, fix, barometer, magnetometer, raw, imu };

struct Arrival {
  Time time;
  Kind kind;
  std::size_t index;
};

template <class Item>
Time time_of(const Item& item) {
  return item.time;
}
Time time_of(const std::shared_ptr<const RawEpoch>& epoch) { return epoch->time; }

}  // namespace

void replay(const NavigationLog& log, Navigator& navigator, const ReplayOptions& options,
            const std::function<void(Time)>& after_imu) {
  std::vector<Arrival> arrivals;
  Random random(options.seed);
  const NavigatorOptions& sensors = navigator.options();
  // Each comes when it was measured, whatever its stamp: a latency of many seconds is no delay.
  const auto schedule = [&](const auto& items, Kind kind, bool delayed, double latency) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      const double delay = delayed ? random.uniform(options.gnss_delay_low, options.gnss_delay_high) : 0;
      const Time time = time_of(items[i]);
      if (time < options.from || time > options.to) continue;
      arrivals.push_back({Time{time.nanoseconds + Time::from_seconds(delay - latency).nanoseconds}, kind, i});
    }
  };
  schedule(options.headings, Kind::heading, false, 0);
  schedule(log.gnss.velocities, Kind::velocity, true, sensors.gnss_velocity_latency);
  schedule(log.gnss.fixes, Kind::fix, true, sensors.gnss_position_latency);
  schedule(log.barometer, Kind::barometer, false, sensors.barometer_latency);
  schedule(log.magnetometer, Kind::magnetometer, false, sensors.magnetometer_latency);
  schedule(options.raw, Kind::raw, true, sensors.gnss_position_latency);
  // A log keeps the order in which its IMU was written, also where stamps go back; the Navigator judges that.
  const std::size_t aiding = arrivals.size();
  schedule(log.imu, Kind::imu, false, 0);
  std::stable_sort(arrivals.begin(), arrivals.begin() + static_cast<std::ptrdiff_t>(aiding),
                   [](const Arrival& a, const Arrival& b) { return a.time < b.time; });

  Time last_road = log.imu.empty() ? Time{} : log.imu.front().time;
  std::size_t next = 0;
  const auto play_aiding = [&](Time until) {
    for (; next < aiding && arrivals[next].time <= until; ++next) {
      const std::size_t i = arrivals[next].index;
      switch (arrivals[next].kind) {
        case Kind::heading:
          navigator.add(options.headings[i]);
          break;
        case Kind::velocity:
          navigator.add(log.gnss.velocities[i]);
          break;
        case Kind::fix:
          navigator.add(log.gnss.fixes[i]);
          break;
        case Kind::barometer:
          navigator.add(log.barometer[i]);
          break;
        case Kind::magnetometer:
          navigator.add(log.magnetometer[i]);
          break;
        case Kind::raw:
          navigator.add(options.raw[i]);
          break;
        case Kind::imu:
          break;
      }
    }
  };
  for (std::size_t k = aiding; k < arrivals.size(); ++k) {
    play_aiding(arrivals[k].time);
    if (options.road_rate > 0 && seconds_between(last_road, arrivals[k].time) >= 1 / options.road_rate) {
      last_road = arrivals[k].time;
      navigator.add(RoadMotion{last_road});
    }
    navigator.add(log.imu[arrivals[k].index]);
    if (after_imu) after_imu(arrivals[k].time);
  }
  play_aiding(Time{INT64_MAX});
  navigator.finish();
}

}  // namespace pade::navigation
