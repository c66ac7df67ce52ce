// What a navigation, the mapper and a whole run say of themselves, in numbers: navigation.json and the
// `health` of run.json (docs/design.md). The sentences that follow from them are hints (core/hint.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pade/core/options.hpp"

namespace pade::navigation {

/// How far the filter can be relied on.
enum class NavigationStatus : std::uint8_t {
  uninitialised,   ///< nothing is known yet
  levelled,        ///< attitude, and yaw with a standard deviation over 0.125 rad or not at all
  yaw_known,       ///< no GNSS velocity has confirmed it yet
  navigating,      ///< all is well
  dead_reckoning,  ///< no GNSS velocity for a while, or none that the positions do not contradict
  lost,            ///< the measurements refute the covariance: nothing here is to be relied on
};

/// What the filter says of itself at one moment, and what it counted until then.
struct Health {
  NavigationStatus status = NavigationStatus::uninitialised;  ///< now
  double seconds_since_velocity = 0;                          ///< since one passed its gate
  double seconds_since_position = 0;                          ///< the same of GNSS positions
  double yaw_sigma = 0;                                       ///< rad
  std::uint64_t imu_refused = 0;  ///< not finite, or not later than the one before
  std::uint64_t imu_gaps = 0;     ///< pairs of samples farther apart than FilterOptions::gap
  std::uint64_t too_late = 0;     ///< measurements older than the history
  std::uint64_t too_new = 0;      ///< measurements stamped so far after the IMU that they cannot be kept
  std::uint64_t duplicates = 0;   ///< same sensor, same stamp
  std::uint64_t unusable = 0;     ///< not finite
  std::uint64_t restarts = 0;     ///< after a gap too long to bridge, or when lost for too long
  std::uint64_t restarts_when_lost = 0;  ///< of them, those of the second kind
  std::uint64_t times_lost = 0;          ///< times that the status became `lost`
  std::uint64_t velocity_doubted = 0;    ///< times that the GNSS velocities contradicted the positions
  /// Times that the magnetometer contradicted the yaw of the GNSS velocities and the inertial sensors.
  std::uint64_t magnetometer_doubted = 0;
};

/// What the filter made of one sensor.
struct SensorSummary {
  std::string sensor;            ///< "gnss_velocity", "gnss_position", "barometer", "magnetometer", "heading"
  std::size_t measurements = 0;  ///< that reached the filter
  std::size_t refused = 0;       ///< of them, outside the gate, or taken back only in a re-acquisition
  double chi_square = 0;         ///< mean per degree of freedom, before the gate; 1 is consistent
};
}  // namespace pade::navigation

namespace pade {

/// What a navigation says of itself over a log.
struct NavigationHealth {
  navigation::Health filter;                       ///< at the end
  std::size_t frames = 0;                          ///< with a pose
  std::size_t frames_without_answer = 0;           ///< without one
  std::size_t frames_lost = 0;                     ///< of those with a pose, in status `lost`
  double speed_median = 0;                         ///< of the frames with a pose, m/s
  double speed_largest = 0;                        ///< m/s
  std::vector<navigation::SensorSummary> sensors;  ///< those that the log has
};

/// Time between the stamps of the images and those of the poses, as the images tell it.
struct StampOffset {
  double seconds = 0;     ///< what the images' stamps want added to them; negative: they are late
  double sigma = 0;       ///< standard deviation of it, s
  std::size_t pairs = 0;  ///< of frames, of which it was found

  /// No chance, and large enough to matter: more than four sigmas, and than 4 ms.
  [[nodiscard]] bool is_certain() const {
    constexpr double kMatters = 0.004;  // s
    const double size = seconds < 0 ? -seconds : seconds;
    return size > kMatters && size > 4 * sigma;
  }
};

/// Counts of a flight so far.
struct MapperHealth {
  std::size_t frames = 0;   ///< calls of add()
  std::size_t mapped = 0;   ///< of them, those that gave a depth image
  std::size_t skipped = 0;  ///< of them, those that could not be used
  /// Of the last half minute of turns; empty if the camera has not turned unevenly enough to tell 10 ms, or
  /// the poses are said to be exact.
  std::optional<StampOffset> stamp_offset;
};

}  // namespace pade

namespace pade::io {

/// One piece of input that could not be used although the rest can (docs/sequences.md: skipped, not refused).
struct Skipped {
  std::string file;    ///< path as read, or relative to the sequence if it lies inside
  std::string reason;  ///< line or field, what was found, what was expected

  /// Same file and same reason.
  bool operator==(const Skipped&) const = default;
};

/// How much of the input was usable.
struct RunHealth {
  int frames = 0;                     ///< images of the sequence
  int frames_used = 0;                ///< images that had a pose and could be decoded
  int depth_images = 0;               ///< pairs of frames that gave a depth image
  int frames_without_pose = 0;        ///< images left out because no pose is near in time
  int motions_without_scale = 0;      ///< motions between frames that are too short for what is known of them
  std::vector<Skipped> skipped;       ///< in the order of the sequence
  std::vector<std::string> warnings;  ///< what a user should know, one sentence each
  std::optional<NavigationHealth> navigation;  ///< if the poses come from IMU and GNSS
};

}  // namespace pade::io

template <>
struct pade::EnumNames<pade::navigation::NavigationStatus> {
  using Status = pade::navigation::NavigationStatus;
  static constexpr std::array names = {
      std::pair{Status::uninitialised, std::string_view("uninitialised")},
      std::pair{Status::levelled, std::string_view("levelled")},
      std::pair{Status::yaw_known, std::string_view("yaw_known")},
      std::pair{Status::navigating, std::string_view("navigating")},
      std::pair{Status::dead_reckoning, std::string_view("dead_reckoning")},
      std::pair{Status::lost, std::string_view("lost")},
  };
};
