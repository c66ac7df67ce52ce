// Finding the first attitude: static levelling with gyroscope bias, or a start in motion, and yaw from a
// heading, a magnetometer, or a bank of filters that start at yaws all round the compass and are weighed by
// how well they predict the GNSS (docs/navigation.md, section 5).
#pragma once

#include <optional>
#include <vector>

#include "pade/navigation/timeline.hpp"

namespace pade::navigation {

/// Specific force and angular rate of a body at rest.
struct RestMeans {
  Time time;  ///< end of the window
  Vector3d angular_rate;
  Vector3d specific_force;
  double duration = 0;
};

/// Means over the last `level_time` seconds if the body was at rest all the time.
std::optional<RestMeans> detect_rest(const Timeline& timeline, Time now, const AlignmentOptions& options);

/// Puts a filter at rest: level from the specific force, gyroscope bias from the rate, at a yaw (azimuth of
/// the body's x axis, or of its y axis if x is near vertical) with its uncertainty.
/// @param velocity_sigma  m/s; of a body that is known to rest a small one
void start_at_rest(Filter& filter, const RestMeans& rest, double yaw, double yaw_sigma,
                   double velocity_sigma = 0.05);

/// Azimuth of the body's x axis (y if x is within 20° of the vertical), and its standard deviation.
struct Yaw {
  double angle = 0;
  double sigma = 0;
};
Yaw yaw_of(Filter& filter);

/// What alignment is at.
enum class AlignmentPhase { waiting, levelled, aligned };

class Alignment {
 public:
  Alignment(const FilterOptions& filter, const Vector3d& lever_arm, const AlignmentOptions& options);
  void reset();

  /// Looks at the data up to `now`. When `aligned`, `result()` holds the filter, at a time at or before
  /// `now`.
  AlignmentPhase update(Timeline& timeline, Time now);
  [[nodiscard]] const Filter& result() const { return bank_[best_].filter; }

 private:
  struct Hypothesis {
    Filter filter;
    bool alive = false;
  };

  bool start_from_rest(Timeline& timeline, Time now);
  [[nodiscard]] bool is_moving(const Timeline& timeline, Time now) const;
  bool start_in_motion(Timeline& timeline, Time now);
  void begin_at_first_fix(const Timeline& timeline, Time until);
  AlignmentPhase weigh();

  AlignmentOptions options_;
  std::vector<Hypothesis> bank_;
  std::size_t best_ = 0;
  bool running_ = false;
  bool started_clock_ = false;
  bool yaw_measured_ = false;
  bool begins_anew_ = false;  ///< after a gap or a filter that gave itself up: in flight, most likely
  Time first_;
  Time last_look_;
};

}  // namespace pade::navigation
