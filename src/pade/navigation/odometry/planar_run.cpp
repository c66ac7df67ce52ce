#include "pade/navigation/odometry/planar_run.hpp"

#include <algorithm>

namespace pade::navigation {
namespace {

/// Of two neighbours; as old as the first.
PlanarOdometry mean_of(const PlanarOdometry& a, const PlanarOdometry& b) {
  return {a.time, 0.5 * (a.speed + b.speed), 0.5 * (a.yaw_rate + b.yaw_rate),
          std::max(a.speed_sigma, b.speed_sigma), std::max(a.yaw_rate_sigma, b.yaw_rate_sigma)};
}

/// Moves the filter to a time by the samples up to it; between two samples it holds the earlier one.
class Mover {
 public:
  explicit Mover(const std::vector<PlanarOdometry>& samples) : samples_(samples) {}

  /// Whether the samples have begun, and have not ended for good.
  [[nodiscard]] bool covers(Time time, double gap) const {
    if (samples_.empty() || time < samples_.front().time) return false;
    return seconds_between(samples_.back().time, time) <= gap;
  }
  void move(PlanarFilter& filter, Time to) {
    for (; next_ < samples_.size() && samples_[next_].time <= to; ++next_) {
      if (next_ > 0) filter.propagate(samples_[next_].time, mean_of(samples_[next_ - 1], samples_[next_]));
    }
    if (next_ > 0) filter.propagate(to, samples_[next_ - 1]);
  }

 private:
  const std::vector<PlanarOdometry>& samples_;
  std::size_t next_ = 0;
};

}  // namespace

PlanarRun run_planar(const gnss::RawLog& log, const gnss::PositioningOptions& positioning,
                     const PlanarOptions& options, PlanarCoupling coupling) {
  PlanarRun run;
  RawObserver observer(log.broadcast, positioning, {}, Time{0});
  PlanarFilter filter(options);
  Mover mover(log.odometry);
  for (const gnss::KnownRangeEpoch& epoch : log.known_ranges) {
    if (!mover.covers(epoch.time, options.gap)) {
      ++run.outside;
      continue;
    }
    mover.move(filter, epoch.time);
    const auto raw = observer.observe(epoch);
    if (!raw || (!filter.started() && !raw->fix)) {
      ++run.before_start;
      continue;
    }
    if (!filter.started()) {
      filter.start(epoch.time, raw->fix->position);
      ++run.starts;
    }
    PlanarFrame frame;
    if (coupling == PlanarCoupling::tight) {
      frame.shares = filter.update(*raw);
    } else if (raw->fix) {
      frame.fix_share = filter.update(*raw->fix);
    } else {
      ++run.without_position;
    }
    frame.estimate = filter.estimate();
    if (frame.estimate.yaw_known && !run.yaw_found) run.yaw_found = epoch.time;
    run.frames.push_back(std::move(frame));
  }
  run.place = observer.frame();
  run.tally = filter.tally();
  return run;
}

}  // namespace pade::navigation
