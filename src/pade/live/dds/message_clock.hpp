// Between the stamps of messages and our monotonic clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>

#include "pade/core/time.hpp"
#include "pade/live/dds/dds_options.hpp"

namespace pade::live {

/// What tells the time; tests have others.
struct TimeSources {
  std::function<Time()> ours;    ///< monotonic; empty: now_of_ours()
  std::function<Time()> system;  ///< since 1970; empty: this machine's
};

/// The way there and back gives the same stamp, unless the clock was set between. Any thread.
class MessageClock {
 public:
  explicit MessageClock(StampClock kind, TimeSources sources = {});

  /// By our clock.
  [[nodiscard]] Time now() const { return sources_.ours(); }

  /// Of the monotonic clock. Empty: the stamp is more than a second off the system's clock, so of another
  /// one. A recording that is played may be played at any pace and may pause: its times go on as it tells
  /// them, and behind() says by how much they are not ours. It begins anew where a stamp is two seconds
  /// before the newest, or ahead of it by two seconds more than went by meanwhile.
  [[nodiscard]] std::optional<Time> to_ours(Time stamp);
  /// The stamp of a time of ours. Of a recording that does not play yet: since 1970.
  [[nodiscard]] Time to_stamp(Time ours);
  /// How far what a recording tells now lies behind our time, beyond the first message, s: 0 up to a tenth of
  /// a second, and of the system's clock; below 0 where it is played faster.
  [[nodiscard]] double behind() const;
  /// How often stamps before and after did not belong together: a recording has begun anew, or the system's
  /// clock was set by more than a millisecond.
  [[nodiscard]] std::size_t restarts() const;

 private:
  [[nodiscard]] std::int64_t measured() const;
  void follow_the_system();

  StampClock kind_;
  TimeSources sources_;
  mutable std::mutex mutex_;
  std::int64_t ahead_ = 0;  // of stamps, ns
  bool anchored_ = false;
  Time newest_, newest_came_;  // of a recording: by its time, and when it came by ours
  std::size_t restarts_ = 0;
};

}  // namespace pade::live
