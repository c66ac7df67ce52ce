#include "pade/navigation/timeline.hpp"

namespace pade::navigation {

Innovation apply(Filter& filter, const Measurement& m, double declination) {
  switch (m.kind) {
    case SensorKind::gnss_velocity:
      return filter.update(GnssVelocity{m.time, m.value, m.covariance});
    case SensorKind::gnss_position:
      return filter.update(GnssFix{m.time, m.value, m.covariance});
    case SensorKind::barometer:
      return filter.update(BarometricHeight{m.time, m.value.x(), m.sigma});
    case SensorKind::heading:
      return filter.update(Heading{m.time, m.value.x(), m.sigma});
    case SensorKind::magnetometer:
      return filter.update(MagneticField{m.time, m.value, m.sigma}, declination);
    case SensorKind::zero_velocity:
      return filter.update(ZeroVelocity{m.time, m.sigma});
    case SensorKind::road:
      return filter.update(RoadMotion{m.time, m.sigma});
    case SensorKind::raw_gnss:
      return filter.update(*m.raw);
    case SensorKind::camera:
      return m.camera ? filter.update(*m.camera) : filter.mark_image();
    case SensorKind::range:
      return filter.update(RangeToGround{m.time, m.value.x(), m.sigma, m.extra});
  }
  return {};
}

std::optional<std::size_t> Timeline::place_of(const Measurement& measurement) const {
  std::size_t at = measurements.count_until(measurement.time);
  while (at > 0 && measurements[at - 1].time == measurement.time &&
         measurements[at - 1].kind >= measurement.kind) {
    if (measurements[at - 1].kind == measurement.kind) return std::nullopt;
    --at;
  }
  return at;
}

void Timeline::step(Filter& filter, Time to, std::size_t next_sample, Time limit) const {
  const Time from = filter.state().time;
  if (to <= from || imu.empty()) return;
  const bool has_next = next_sample < imu.size() && imu[next_sample].time <= limit;
  const bool has_last = next_sample > 0;
  if (!has_last && !has_next) return;
  const ImuSample& a = has_last ? imu[next_sample - 1] : imu[next_sample];
  const ImuSample& b = has_next ? imu[next_sample] : a;
  const double interval = seconds_between(a.time, b.time);
  const auto fraction = [&](Time t) { return interval > 0 ? seconds_between(a.time, t) / interval : 0.0; };
  const double s0 = fraction(from);
  const double s1 = fraction(to);
  const double middle = 0.5 * (s0 + s1);
  const Vector3d turn = b.angular_rate - a.angular_rate;
  filter.propagate(to, a.angular_rate + middle * turn,
                   a.specific_force + middle * (b.specific_force - a.specific_force),
                   a.angular_rate + s1 * turn);
  const bool gap =
      interval > filter.options().gap || (!has_next && seconds_between(a.time, to) > filter.options().gap);
  if (gap) filter.add_gap_noise(seconds_between(from, to));
}

}  // namespace pade::navigation
