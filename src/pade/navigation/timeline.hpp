// Sensor data in the order of their stamps, whatever the order of arrival, and the one function that moves a
// filter along them. The live filter, replays and questions about the past all use it, so they agree to the
// last bit.
#pragma once

#include <cstdint>

#include "pade/core/sensors/measurements.hpp"
#include "pade/navigation/filter.hpp"
#include "pade/navigation/ring.hpp"

namespace pade::navigation {

/// Uses one measurement in the filter.
Innovation apply(Filter& filter, const Measurement& measurement, double declination);

struct Timeline {
  Timeline(std::size_t imu_capacity, std::size_t measurement_capacity)
      : imu(imu_capacity), measurements(measurement_capacity) {}

  TimeRing<ImuSample> imu;
  TimeRing<Measurement> measurements;  ///< ordered by (time, kind)
  double declination = 0;              ///< of magnetic north, rad

  /// Where a measurement belongs, or nothing if one of that kind and stamp is there already.
  [[nodiscard]] std::optional<std::size_t> place_of(const Measurement& measurement) const;

  /// Moves the filter to `to`, using every measurement with a stamp in (filter time, to]. Between samples the
  /// IMU is interpolated linearly, but nothing stamped after `to` is used: there the last sample is held.
  /// With `record` the innovations are kept in the timeline. Calls `after_sample()` behind each IMU sample.
  template <class AfterSample>
  void advance(Filter& filter, Time to, bool record, AfterSample after_sample);
  void advance(Filter& filter, Time to) {
    advance(filter, to, false, [] {});
  }

 private:
  void step(Filter& filter, Time to, std::size_t next_sample, Time limit) const;
};

template <class AfterSample>
void Timeline::advance(Filter& filter, Time to, bool record, AfterSample after_sample) {
  std::size_t sample = imu.count_until(filter.state().time);  // first sample after the filter
  std::size_t measurement = measurements.count_until(filter.state().time);
  while (true) {
    const bool has_sample = sample < imu.size() && imu[sample].time <= to;
    const bool has_measurement = measurement < measurements.size() && measurements[measurement].time <= to;
    if (has_measurement && (!has_sample || measurements[measurement].time <= imu[sample].time)) {
      Measurement& m = measurements[measurement++];
      step(filter, m.time, sample, to);
      const Innovation innovation = apply(filter, m, declination);
      if (record) m.innovation = innovation;
    } else if (has_sample) {
      step(filter, imu[sample].time, sample, to);
      filter.observe(imu[sample]);
      ++sample;
      // A measurement of the same stamp comes first in the order above, so the state is complete here.
      after_sample();
    } else {
      step(filter, to, sample, to);
      return;
    }
  }
}

}  // namespace pade::navigation
