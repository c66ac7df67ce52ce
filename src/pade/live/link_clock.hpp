// The autopilot's clock against ours, from the questions and answers of TIMESYNC.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "pade/core/time.hpp"

namespace pade::live {

/// How far its clock is ahead of ours, by the answer that came back fastest of those of the last seconds: an
/// answer errs by at most half of its round trip, whatever delayed it.
class LinkClock {
 public:
  /// An answer.
  /// @param asked     our clock when the question left
  /// @param answered  the autopilot's clock when it answered
  /// @param received  our clock when the answer had come
  void add(Time asked, Time answered, Time received);

  /// Whether enough answers have come since the start, or since the clock was last found to have jumped, and
  /// the last of them not more than 10 s ago.
  /// @param now  ours
  [[nodiscard]] bool synchronised(Time now) const;
  /// A moment of the autopilot's clock on ours. Empty where it is not synchronised then.
  [[nodiscard]] std::optional<Time> to_ours(Time autopilot) const;
  /// Of ours on the autopilot's. Empty where it is not synchronised then.
  [[nodiscard]] std::optional<Time> to_autopilot(Time ours) const;
  /// Half of the round trip that counts: no error is greater but by drift, s. 0 without an answer.
  [[nodiscard]] double bound() const;
  /// How often its clock has jumped: it has started anew.
  [[nodiscard]] std::size_t restarts() const { return restarts_; }

 private:
  struct Sample {
    Time received;
    std::int64_t offset = 0;      // autopilot - ours, ns
    std::int64_t round_trip = 0;  // ns
  };
  [[nodiscard]] bool contradicts(const Sample& sample) const;
  void choose(Time now);

  std::deque<Sample> samples_;   // of the last seconds
  std::deque<Sample> doubtful_;  // that contradict them
  std::optional<Sample> best_;
  std::size_t restarts_ = 0;
  bool ready_ = false;
};

}  // namespace pade::live
