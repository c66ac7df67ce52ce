// The clock over simulated links: drift, jitter, restarts.
#include "pade/live/link_clock.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pade::live {
namespace {

constexpr double kMilli = 1e6;  // ns

/// An autopilot at the other end of a link whose delays are exponential and cut off.
class Link {
 public:
  explicit Link(unsigned seed, double drift) : random_(seed), drift_(drift) {}

  /// The autopilot's clock at a moment of ours, ns.
  [[nodiscard]] double clock(double ours) const { return (ours - start_) * (1 + drift_) + zero_; }
  void restart(double now) {
    start_ = now;
    zero_ = 0;
  }
  void ask(LinkClock& clock_sync, double now) {
    const double there = now + delay();
    const double back = there + delay();
    clock_sync.add(at(now), at(clock(there)), at(back));
  }
  static Time at(double nanoseconds) { return {std::llround(nanoseconds)}; }

 private:
  double delay() {
    constexpr double kLeast = 0.4 * kMilli;
    return kLeast + std::min(30 * kMilli, std::exponential_distribution<double>(1 / (3 * kMilli))(random_));
  }
  std::mt19937 random_;
  double drift_;
  double start_ = -77e9;
  double zero_ = 0;
};

double error_ms(const LinkClock& sync, const Link& link, double now) {
  const auto ours = sync.to_ours(Link::at(link.clock(now)));
  return ours ? std::abs(static_cast<double>(ours->nanoseconds) - now) / kMilli : 1e9;
}

double percentile95(std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() * 95 / 100];
}

constexpr double kStep = 100 * kMilli;  // 10 Hz

TEST(LinkClock, ErrsLessThanHalfAMillisecondUnderDriftAndJitter) {
  std::vector<double> errors;
  double latest = 0;  // until synchronised, s
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Link link(seed, seed % 2 == 0 ? 20e-6 : -20e-6);
    LinkClock sync;
    double since = -1;
    for (double now = 0; now < 60e9; now += kStep) {
      link.ask(sync, now);
      if (!sync.synchronised(Link::at(now))) continue;
      if (since < 0) since = now;
      errors.push_back(error_ms(sync, link, now + kStep));
    }
    latest = std::max(latest, since * 1e-9);
    EXPECT_EQ(sync.restarts(), 0U);
  }
  RecordProperty("error_95_ms", std::to_string(percentile95(errors)));
  RecordProperty("synchronised_s", std::to_string(latest));
  EXPECT_LE(percentile95(errors), 0.5);
  EXPECT_LE(latest, 3);
}

TEST(LinkClock, SeesARestartWithinASecondAndSynchronisesAnew) {
  double seen_latest = 0, ready_latest = 0;
  std::vector<double> errors;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Link link(seed, 20e-6);
    LinkClock sync;
    double now = 0;
    for (; now < 20e9; now += kStep) link.ask(sync, now);
    link.restart(now);
    const double restart = now;
    double seen = -1, ready = -1;
    for (; now < restart + 20e9; now += kStep) {
      link.ask(sync, now);
      if (seen < 0 && sync.restarts() == 1) seen = now;
      if (seen >= 0 && ready < 0 && sync.synchronised(Link::at(now))) ready = now;
      if (ready >= 0) errors.push_back(error_ms(sync, link, now + kStep));
    }
    ASSERT_EQ(sync.restarts(), 1U);
    ASSERT_GE(ready, 0);
    seen_latest = std::max(seen_latest, (seen - restart) * 1e-9);
    ready_latest = std::max(ready_latest, (ready - restart) * 1e-9);
  }
  RecordProperty("seen_s", std::to_string(seen_latest));
  RecordProperty("synchronised_s", std::to_string(ready_latest));
  EXPECT_LE(seen_latest, 1);
  EXPECT_LE(ready_latest, 3);
  EXPECT_LE(percentile95(errors), 0.5);
}

TEST(LinkClock, OneOddAnswerChangesNothing) {
  Link link(3, 0);
  LinkClock sync;
  double now = 0;
  for (; now < 5e9; now += kStep) link.ask(sync, now);
  const double before = error_ms(sync, link, now);
  sync.add(Link::at(now), Link::at(link.clock(now) + 5e9), Link::at(now + 2 * kMilli));
  sync.add(Link::at(now), Link::at(link.clock(now) + 5e9),
           Link::at(now - 2 * kMilli));  // before it was asked
  EXPECT_EQ(error_ms(sync, link, now), before);
  EXPECT_EQ(sync.restarts(), 0U);
}

/// Our line to the autopilot is cut, its poses go on: by and by nothing is known of its clock any more.
TEST(LinkClock, ExpiresWhereAnswersStop) {
  Link link(5, 20e-6);
  LinkClock sync;
  double now = 0;
  for (; now < 5e9; now += kStep) link.ask(sync, now);
  EXPECT_TRUE(sync.synchronised(Link::at(now + 8e9)));
  EXPECT_TRUE(sync.to_autopilot(Link::at(now + 8e9)));
  EXPECT_FALSE(sync.synchronised(Link::at(now + 11e9)));
  EXPECT_FALSE(sync.to_autopilot(Link::at(now + 11e9)));
  EXPECT_FALSE(sync.to_ours(Link::at(link.clock(now + 11e9))));
  for (now += 20e9; now < 26e9; now += kStep) link.ask(sync, now);
  EXPECT_TRUE(sync.synchronised(Link::at(now)));
}

TEST(LinkClock, SaysNothingBeforeItKnows) {
  LinkClock sync;
  EXPECT_FALSE(sync.synchronised({5}));
  EXPECT_FALSE(sync.to_ours({5}));
  sync.add({0}, {100}, {10});
  EXPECT_FALSE(sync.to_autopilot({5}));
  EXPECT_NEAR(sync.bound(), 5e-9, 1e-15);
}

TEST(LinkClock, BothWaysAreInverse) {
  Link link(3, 0);
  LinkClock sync;
  for (double now = 0; now < 5e9; now += kStep) link.ask(sync, now);
  const Time ours{4'321'000'000};
  EXPECT_EQ(sync.to_ours(*sync.to_autopilot(ours)), ours);
}

}  // namespace
}  // namespace pade::live
