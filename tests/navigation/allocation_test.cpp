// No allocation in the loop: this program counts every call of malloc, and so of operator new and of Eigen.
#include <cstddef>

#include <gtest/gtest.h>

#include "pade/navigation/navigator.hpp"

#include "navigation/flight.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PADE_COUNTS_ALLOCATIONS 1
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier)
#endif

namespace {
std::size_t allocations = 0;
}

#ifdef PADE_COUNTS_ALLOCATIONS
extern "C" void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace pade::navigation {
namespace {

Time moment(double seconds) { return Time::from_seconds(seconds); }

TEST(Navigator, AllocatesNothingAfterTheStart) {
#ifndef PADE_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "needs glibc's malloc without a sanitizer";
#endif
  const NavigationLog log =
      record(Flight{}, 25, simulation::ImuModel::industrial(), simulation::GnssModel::single_point(), 1);
  Navigator navigator(NavigatorOptions{});
  navigator.add(Heading{moment(1), 0.7, 0.03});
  std::size_t next = 0;
  std::size_t before = 0;
  std::size_t questions = 0;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    if (i == 1000) before = allocations;
    // A late GNSS epoch every time: replay is part of the loop.
    while (next < log.gnss.fixes.size() &&
           log.gnss.fixes[next].time < moment(log.imu[i].time.seconds() - 0.15)) {
      navigator.add(log.gnss.velocities[next]);
      navigator.add(log.gnss.fixes[next++]);
    }
    navigator.add(log.imu[i]);
    if (i > 1000 && i % 20 == 0) {
      const Time now = log.imu[i].time;
      questions += navigator.relative_pose(moment(now.seconds() - 0.1), now, Pose{}).answer == Answer::valid;
      questions += navigator.absolute_pose(now).answer == Answer::valid;
      questions += navigator.health().status == NavigationStatus::navigating;
    }
  }
  EXPECT_GT(before, 0U) << "the counter works";
  EXPECT_EQ(allocations, before);
  EXPECT_GT(questions, 500U);
}

}  // namespace
}  // namespace pade::navigation
