#include "pade/navigation/timeline.hpp"

#include <algorithm>

namespace pade::navigation {

namespace {

/// Each kind of measurement with what of the filter uses it.
struct UpdateOf {
  Filter& filter;
  double declination;

  Innovation operator()(const MagneticField& m) const { return filter.update(m, declination); }
  Innovation operator()(const std::shared_ptr<const RawEpoch>& m) const { return filter.update(*m); }
  Innovation operator()(const std::shared_ptr<const CameraMotion>& m) const {
    return m ? filter.update(*m) : filter.mark_image();
  }
  template <class Sensor>
  Innovation operator()(const Sensor& m) const {
    return filter.update(m);
  }
};

}  // namespace

Innovation apply(Filter& filter, const Measurement& measurement, double declination) {
  return std::visit(UpdateOf{filter, declination}, measurement.value);
}

std::optional<std::size_t> Timeline::place_of(const Measurement& measurement) const {
  std::size_t at = measurements.count_until(measurement.time);
  while (at > 0 && measurements[at - 1].time == measurement.time &&
         measurements[at - 1].kind() >= measurement.kind()) {
    if (measurements[at - 1].kind() == measurement.kind()) return std::nullopt;
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
  if (gap) {
    filter.add_gap_noise(std::max(0.0, seconds_between(a.time, from)),
                         std::max(0.0, seconds_between(a.time, to)));
  }
}

}  // namespace pade::navigation
