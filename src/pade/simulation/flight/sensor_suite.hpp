// The instruments of a simulated vehicle, fed with its true motion as it goes: a path known in advance or a
// vehicle that is stepped.
#pragma once

#include <cstdint>

#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/flight/sensors/aiding.hpp"
#include "pade/simulation/flight/sensors/imu.hpp"

namespace pade::simulation {

/// One of each. Every instrument has a stream of random numbers of its own: leaving one out, or sampling
/// another more often, changes nothing for the rest. Sample each at its times in order.
struct SensorSuite {
  SensorSuite(const SensorOptions& options, std::uint64_t seed);

  Imu imu;
  Gnss gnss;
  Barometer barometer;
  Magnetometer magnetometer;
};

/// The moments at which an instrument of some rate measures: i / rate, from 0.
class SampleClock {
 public:
  /// @param rate  Hz, > 0
  explicit SampleClock(double rate) : rate_(rate) {}
  /// Whether the next moment has come; then the one after it is the next. Ask at least `rate` times a second.
  bool is_due(double time) {
    if (static_cast<double>(count_) / rate_ > time + 1e-9) return false;
    ++count_;
    return true;
  }

 private:
  double rate_;
  std::int64_t count_ = 0;
};

}  // namespace pade::simulation
