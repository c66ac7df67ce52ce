#include "pade/live/link_clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace pade::live {
namespace {

constexpr std::int64_t kWindow = 8'000'000'000;   // ns
constexpr std::size_t kEnough = 20;               // answers
constexpr std::size_t kJump = 3;                  // answers in a row that cannot be of the same clock
constexpr std::int64_t kSlack = 1'000'000;        // ns, for drift
constexpr std::int64_t kLongest = 1'000'000'000;  // round trip, ns
constexpr std::size_t kMost = 512;                // answers kept
constexpr double kDrift = 30e-6;                  // of two quartz clocks against each other

}  // namespace

void LinkClock::add(Time asked, Time answered, Time received) {
  const std::int64_t round_trip = received.nanoseconds - asked.nanoseconds;
  constexpr std::int64_t kLast = 4'600'000'000'000'000'000;  // ns: differences of two times fit
  if (round_trip < 0 || round_trip > kLongest) return;
  if (answered.nanoseconds > kLast || answered.nanoseconds < -kLast) return;
  const std::int64_t middle = asked.nanoseconds + round_trip / 2;
  const Sample sample{received, answered.nanoseconds - middle, round_trip};
  if (contradicts(sample)) {
    doubtful_.push_back(sample);
    if (doubtful_.size() < kJump) return;
    samples_ = std::move(doubtful_);
    ready_ = false;
    ++restarts_;
  } else {
    samples_.push_back(sample);
  }
  doubtful_.clear();
  choose(received);
}

/// Both err by half of their round trips at most.
bool LinkClock::contradicts(const Sample& sample) const {
  if (!best_) return false;
  return std::abs(sample.offset - best_->offset) > (sample.round_trip + best_->round_trip) / 2 + kSlack;
}

void LinkClock::choose(Time now) {
  const auto age = [&](const Sample& s) { return now.nanoseconds - s.received.nanoseconds; };
  while (samples_.size() > 1 && (age(samples_.front()) > kWindow || samples_.size() > kMost)) {
    samples_.pop_front();
  }
  const auto cost = [&](const Sample& s) {
    return 0.5 * static_cast<double>(s.round_trip) + kDrift * static_cast<double>(age(s));
  };
  best_ = *std::min_element(samples_.begin(), samples_.end(),
                            [&](const Sample& a, const Sample& b) { return cost(a) < cost(b); });
  ready_ = ready_ || samples_.size() >= kEnough;
}

bool LinkClock::synchronised(Time now) const {
  constexpr double kExpires = 10;  // s
  return ready_ && seconds_between(samples_.back().received, now) < kExpires;
}

std::optional<Time> LinkClock::to_ours(Time autopilot) const {
  if (!ready_) return std::nullopt;
  const Time ours{autopilot.nanoseconds - best_->offset};
  return synchronised(ours) ? std::optional(ours) : std::nullopt;
}

std::optional<Time> LinkClock::to_autopilot(Time ours) const {
  if (!synchronised(ours)) return std::nullopt;
  return Time{ours.nanoseconds + best_->offset};
}

double LinkClock::bound() const { return best_ ? 0.5e-9 * static_cast<double>(best_->round_trip) : 0; }

}  // namespace pade::live
