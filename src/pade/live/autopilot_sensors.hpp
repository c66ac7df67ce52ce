// What an autopilot says of its sensors, as measurements in the project's units and frames (body FLU, local
// ENU): converted here and nowhere else.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/core/time.hpp"
#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/live/mavlink/frame.hpp"

namespace pade::live {

/// What lies between slower samples of an IMU is lost, Hz.
inline constexpr double slowest_imu = 20;

inline constexpr std::uint8_t ardupilot_kind = 3;  ///< MAV_AUTOPILOT
inline constexpr std::uint8_t px4_kind = 12;       ///< the same

/// Who flies the vehicle.
struct Autopilot {
  std::uint8_t system = 0;     ///< its number on the link
  std::uint8_t component = 0;  ///< usually 1
  std::uint8_t kind = 0;       ///< MAV_AUTOPILOT: 3 ArduPilot, 12 PX4
  std::uint8_t vehicle = 0;    ///< MAV_TYPE: 2 quadrotor
};

/// "ArduPilot", "PX4" or "autopilot 7".
std::string name_of(const Autopilot& autopilot);

/// Stamps of an autopilot count microseconds since it started, or since 1970 if it knows the date: both as
/// time since the start.
class BootClock {
 public:
  /// Learns from SYSTEM_TIME how the two belong together; other messages change nothing.
  void learn(const mavlink::Frame& frame);
  /// A stamp in µs. Empty if it counts since 1970 and no SYSTEM_TIME has come yet.
  [[nodiscard]] std::optional<Time> time_of(std::uint64_t microseconds) const;

 private:
  std::optional<std::int64_t> boot_since_1970_;  // µs
};

/// What has come since it was last asked for, each in the order of its arrival.
struct NewSamples {
  std::vector<ImuSample> imu;
  std::vector<MagneticField> fields;
  std::vector<BarometricHeight> heights;
  std::vector<io::GeodeticFix> fixes;
};

/// Which sensors a log must have to be of use.
enum class SensorNeed : std::uint8_t {
  imu_and_gnss,  ///< to navigate
  imu,           ///< to compare turns; a GNSS that is missing is a remark
};

/// Gathers IMU, GNSS, magnetometer and barometer from the messages of one autopilot. Samples that it repeats
/// count once.
///
/// HIGHRES_IMU is in SI units; SCALED_IMU in milli-g and mrad/s, and ArduPilot's RAW_IMU as well (that of
/// others has no unit and is left out). The barometer is turned into height by the standard atmosphere.
class SensorGatherer {
 public:
  /// @param autopilot  whose messages count; those of others are passed over
  /// @param clock      which knows SYSTEM_TIME already, or learns it as messages come
  SensorGatherer(const Autopilot& autopilot, const BootClock& clock) : autopilot_(autopilot), clock_(clock) {}

  void add(const mavlink::Frame& frame);

  /// All that came, stamped by the autopilot's time since its start. Positions are east, north, up of the
  /// first fix; where the messages state no accuracy, that of io::GnssDefaults is taken, with a remark.
  /// @param name  stands in the message. Errors: the IMU or the GNSS is missing, or the IMU is too slow to
  ///              be integrated
  [[nodiscard]] Result<NavigationLog> log(const std::string& name,
                                          SensorNeed need = SensorNeed::imu_and_gnss) const;
  /// Hands over what came since the last call, and keeps none of it: for a link, which has no end. Where the
  /// same comes in several messages, those of HIGHRES_IMU count, else of SCALED_IMU (SCALED_PRESSURE), as
  /// soon as there is one and until it has been silent for a second.
  [[nodiscard]] NewSamples take();
  [[nodiscard]] std::size_t unitless() const { return unitless_; }        ///< RAW_IMU that nobody can read
  [[nodiscard]] std::size_t without_fix() const { return without_fix_; }  ///< fixes in fewer dimensions

 private:
  enum Source : std::uint8_t { highres, scaled, raw };
  template <class Message>
  void add_integers(const Message& message, Time time, Source source);
  void add_highres(const mavlink::Frame& frame);
  void add_pressure(std::optional<Time> time, double hectopascal, Source source);
  void add_fix(const mavlink::Frame& frame);
  void add_field(Time time, const Eigen::Vector3d& frd, Source source);

  Autopilot autopilot_;
  BootClock clock_;
  /// Samples of one kind from one message.
  template <class Sample>
  struct Channel {
    std::vector<Sample> samples;
    std::optional<Time> last;  // also of what has been taken
    /// False: the same once more.
    bool is_new(Time time) {
      if (last == time) return false;
      last = time;
      return true;
    }
  };
  std::array<Channel<ImuSample>, 3> imu_;  // by source
  std::array<Channel<MagneticField>, 3> fields_;
  std::array<Channel<BarometricHeight>, 2> heights_;  // HIGHRES_IMU, SCALED_PRESSURE
  Channel<io::GeodeticFix> fixes_;
  std::size_t unitless_ = 0;  // RAW_IMU of somebody whose units nobody knows
  std::size_t without_fix_ = 0;
};

}  // namespace pade::live
