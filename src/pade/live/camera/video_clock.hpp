// Where the clock of a video stream lies in ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "pade/core/time.hpp"

namespace pade::live {

/// A stream's stamps are those of its sender; what is known is when each frame arrived. No frame arrives
/// before it was sent, so the least delay so far is nearest to the truth: what it is itself (encoding and the
/// way: tens of milliseconds to some hundred) cannot be seen from here and remains in the stamps. A clock
/// that runs slower by up to 100 ppm is followed at that rate. Frames that a congested network holds up keep
/// their times, unless all of ten seconds come more than a second late.
class VideoClock {
 public:
  /// The time of a frame by our clock, later than its exposure by the least delay. Empty in the first half
  /// second of a stream, in which what had piled up at the sender arrives, and of a frame whose stamp is no
  /// later than the one before. Where the sender's clock was set it begins anew: a stamp is earlier than the
  /// one before, or its frame comes more than a second sooner than the least delay allows. One that comes
  /// late is late, and no more: its stamp follows on the one before. Where all come late for ten seconds it
  /// is the clock that does not keep up (a camera that counts its nominal rate in low light), and it begins
  /// anew as well.
  std::optional<Time> time_of(double seconds, Time arrived) {
    const double at = arrived.seconds() - origin(arrived);
    const double delay = at - seconds;
    constexpr double kJump = 1, kSettling = 0.5, kDrift = 1e-4;  // s, s, s/s
    constexpr double kRepeated = 0.02, kLongestLate = 10;        // s
    const double allowed = least_ + kDrift * (at - last_);
    const bool is_later = seconds > stamp_;
    const bool set_back = seconds < stamp_ - kRepeated, set_forward = delay < allowed - kJump;
    if (delay < allowed + kJump) in_time_ = at;
    const bool is_slow = at - in_time_ > kLongestLate;
    stamp_ = seconds;
    if (!begun_ || set_back || set_forward || is_slow) {
      begun_ = true;
      start_ = at;
      in_time_ = at;
      least_ = delay;
    } else {
      least_ = std::min(delay, allowed);
    }
    last_ = at;
    if (at - start_ < kSettling || !is_later) return std::nullopt;
    const double since = seconds + least_ - at;  // not positive
    return Time{arrived.nanoseconds + static_cast<std::int64_t>(std::llround(1e9 * since))};
  }
  /// How much later than the least delay the newest frame was, s.
  [[nodiscard]] double lateness(double seconds) const { return last_ - seconds - least_; }

 private:
  /// So that seconds since then keep their fractions.
  double origin(Time arrived) {
    if (!zero_) zero_ = arrived.seconds();
    return *zero_;
  }

  std::optional<double> zero_;
  bool begun_ = false;
  double start_ = 0, last_ = 0, least_ = 0, stamp_ = 0;
  double in_time_ = 0;  // of the last frame that was not more than a second late
};

}  // namespace pade::live
