// Whether a log can be what it claims to be: units, axes, clocks. Cheap, before and after every run of the
// filter, so that a hopeless run never looks like a good one.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pade/core/hint.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/navigator.hpp"

namespace pade::navigation {

/// What the data of a log say against each other, before any filter. Which hints there are (docs/formats.md):
///
///   no-overlap         two sensors have no moment in common
///   stamps-go-back     the IMU's clock was set back
///   imu-picked         a slow IMU with much vibration: samples picked from a faster stream
///   upside-down        the specific force points down: forward-right-down data called forward-left-up
///   gyro-unit          angular rates in deg/s, in gentle flight too
///   gyro-axes          gyroscopes in other axes than accelerometers
///   gnss-axes          velocities of the GNSS in north, east, down called east, north, up
///   gnss-lag           velocities of the GNSS late or early, by tenths of a second or by leap seconds
///   gnss-apart         positions and velocities of the GNSS apart in time, and which of them is late
///   gnss-drift         positions and integrated velocities of the GNSS part by many metres
///   gnss-degrees       latitude and longitude where metres are expected
///   gnss-contradiction positions and velocities of the GNSS do not belong together
///   imu-contradiction  IMU and GNSS do not belong together, and no reading above explains it
///
/// How: over windows of 5 s the mean specific force, turned by the integrated gyroscopes, and the change of
/// the GNSS velocity plus gravity are the same vectors but for one rotation (Wahba's problem). What is left
/// over says which reading of the data is right.
std::vector<Hint> check_log(const NavigationLog& log);

/// Stamps of an IMU that jitter, repeat or swap (a clock of milliseconds, samples that arrive in packets) put
/// on straight lines between gaps, in place. Nothing happens if they rise, or if a clock was set back.
/// The hint says what was done; empty if nothing was.
std::optional<Hint> regularise_stamps(std::vector<ImuSample>& samples);

/// What the filter made of each sensor (core/health.hpp).
std::vector<SensorSummary> summarise(std::span<const Measurement> measurements);

/// What the innovations of a run say:
///
///   imu-refused        IMU samples that could not be used
///   sensor-refused     most of a sensor refused (a barometer for ever)
///   inconsistent       a sensor disagrees with the filter far beyond its sigma
///   restarts           the filter had to start anew after a gap
///   lost               the innovations refuted the covariance for a while
///   velocity-doubted   velocities of the GNSS that its positions contradict were left out
///   magnetometer-doubted   a compass whose yaw velocities and inertial sensors contradict was left out
///   measurements-too-late, measurements-too-new   stamps so far from the IMU's that they were not used
std::vector<Hint> check_run(std::span<const SensorSummary> sensors, const Health& health,
                            std::size_t imu_samples);

}  // namespace pade::navigation
