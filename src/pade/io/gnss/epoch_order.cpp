#include "pade/io/gnss/epoch_order.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace pade::io {
namespace {

constexpr std::size_t kLeastRising = 5;  // epochs that can tell that those before them are wrong

}  // namespace

std::string EpochOrder::at(std::size_t place) const { return fmt::format("{}: {} {}", name_, unit_, place); }

void EpochOrder::leave_out_waiting() {
  for (const Placed& w : waiting_)
    backward_.add(fmt::format("{}: earlier than the epoch before, left out", at(w.place)));
  waiting_.clear();
}

void EpochOrder::add(gnss::Epoch epoch, std::size_t place) {
  auto& kept = log_.epochs;
  if (kept.empty() || epoch.time > kept.back().time) {
    leave_out_waiting();
    kept.push_back(std::move(epoch));
    places_.push_back(place);
    return;
  }
  const Time last = waiting_.empty() ? kept.back().time : waiting_.back().epoch.time;
  if (epoch.time == last || epoch.time == kept.back().time) {
    repeated_.add(fmt::format("{}: the time of the epoch before once more, left out", at(place)));
    return;
  }
  if (!waiting_.empty() && epoch.time < last) leave_out_waiting();
  waiting_.push_back({std::move(epoch), place});
  // Those of this file that lie ahead of the epochs which wait.
  const Time first = waiting_.front().epoch.time;
  const auto begin = kept.begin() + static_cast<std::ptrdiff_t>(first_);
  const auto ahead =
      std::partition_point(begin, kept.end(), [&](const gnss::Epoch& e) { return e.time < first; });
  const auto count = static_cast<std::size_t>(kept.end() - ahead);
  const bool repeats = first_ > 0 && ahead == begin && kept[first_ - 1].time >= first;
  if (repeats || waiting_.size() < kLeastRising || waiting_.size() <= count) return;
  for (std::size_t i = places_.size() - count; i < places_.size(); ++i) {
    ahead_.add(fmt::format("{}: later than the epochs behind it, left out", at(places_[i])));
  }
  kept.erase(ahead, kept.end());
  places_.resize(places_.size() - count);
  for (Placed& w : waiting_) {
    kept.push_back(std::move(w.epoch));
    places_.push_back(w.place);
  }
  waiting_.clear();
}

void EpochOrder::finish() {
  leave_out_waiting();
  for (const rinex::Tally* tally : {&repeated_, &backward_, &ahead_}) tally->report(log_.remarks);
}

}  // namespace pade::io
