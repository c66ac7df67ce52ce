#include "pade/live/dds/message_clock.hpp"

#include <chrono>
#include <cstdlib>
#include <utility>

#include "pade/live/camera/folder_source.hpp"

namespace pade::live {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;  // ns
constexpr std::int64_t kOnItsWay =
    30'000'000;  // ns: the first message of a recording was sent before it came

Time system_now() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since).count()};
}

}  // namespace

MessageClock::MessageClock(StampClock kind, TimeSources sources) : kind_(kind), sources_(std::move(sources)) {
  if (!sources_.ours) sources_.ours = now_of_ours;
  if (!sources_.system) sources_.system = system_now;
  ahead_ = measured();
  anchored_ = kind == StampClock::system;
}

/// How far the system's clock is ahead of ours, ns.
std::int64_t MessageClock::measured() const {
  return sources_.system().nanoseconds - sources_.ours().nanoseconds;
}

/// Both clocks go equally fast; only where the one is set, stamps change.
void MessageClock::follow_the_system() {
  constexpr std::int64_t kSet = 1'000'000;  // ns
  if (std::abs(measured() - ahead_) < kSet) return;
  // What lies between reading the one and the other may be a pause of the whole machine: look again.
  const std::int64_t again = measured();
  if (std::abs(again - ahead_) < kSet) return;
  ahead_ = again;
  ++restarts_;
}

std::optional<Time> MessageClock::to_ours(Time stamp) {
  const std::lock_guard lock(mutex_);
  const Time at = now();
  if (kind_ == StampClock::system) {
    follow_the_system();
    const Time ours{stamp.nanoseconds - ahead_};
    if (std::abs(ours.nanoseconds - at.nanoseconds) > kSecond) return std::nullopt;
    return ours;
  }
  if (anchored_) {
    const std::int64_t step = stamp.nanoseconds - ahead_ - newest_.nanoseconds;
    const std::int64_t meanwhile = at.nanoseconds - newest_came_.nanoseconds;
    if (step < -2 * kSecond || step > meanwhile + 2 * kSecond) {
      ++restarts_;
      anchored_ = false;
    }
  }
  if (!anchored_) {
    ahead_ = stamp.nanoseconds - at.nanoseconds + kOnItsWay;
    anchored_ = true;
    newest_ = {};
  }
  const Time ours{stamp.nanoseconds - ahead_};
  if (ours > newest_) {
    newest_ = ours;
    newest_came_ = at;
  }
  return ours;
}

double MessageClock::behind() const {
  const std::lock_guard lock(mutex_);
  if (kind_ == StampClock::system || !anchored_) return 0;
  constexpr std::int64_t kNone = 100'000'000;  // ns
  const std::int64_t behind = newest_came_.nanoseconds - newest_.nanoseconds - kOnItsWay;
  return std::abs(behind) < kNone ? 0 : 1e-9 * static_cast<double>(behind);
}

Time MessageClock::to_stamp(Time ours) {
  const std::lock_guard lock(mutex_);
  if (kind_ == StampClock::system) follow_the_system();
  return {ours.nanoseconds + ahead_};
}

std::size_t MessageClock::restarts() const {
  const std::lock_guard lock(mutex_);
  return restarts_;
}

}  // namespace pade::live
