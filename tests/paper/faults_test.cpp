// Faults put into a recording: how soon the filter says that it is lost, and how it does afterwards
// (docs/navigation.md, section 6). Prints the table that the document quotes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/evaluation/navigation_score.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/replay.hpp"

namespace pade::navigation {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFault = 90;  // s
const fs::path kData = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation";

Time at(double seconds) { return Time::from_seconds(seconds); }

double yaw_of(const TrueState& truth) {
  const Vector3d x = truth.T_world_body.rotation * Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

std::string named(const char* sensor, int axis, double size) {
  return fmt::format("{} {} {:.3g}", sensor, "xyz"[axis], size);
}

/// What is added to the measurements from `kFault` on.
struct Fault {
  std::string name;
  Vector3d rate = Vector3d::Zero();      ///< rad/s, body
  Vector3d force = Vector3d::Zero();     ///< m/s², body
  Vector3d velocity = Vector3d::Zero();  ///< of the GNSS, m/s
  Vector3d ramp = Vector3d::Zero();      ///< of its positions, m/s
  bool headings = false;                 ///< five headings a second, 2° each
};

struct Outcome {
  double noticed = 1e9;  ///< s after the fault at which the status leaves `navigating`
  double nees = 0;       ///< of the translation over 0.1 s, mean from 15 s after the fault on
  double worst = 0;      ///< translation, 95 %, in that time, m
  double flagged = 0;    ///< share of the good pairs that are scale_valid in that time
  Health health;
};

Outcome fly(NavigationLog log, const Fault& fault, ImuClass imu, std::uint64_t seed) {
  const std::vector<TrueState> truth = log.truth;
  for (ImuSample& sample : log.imu) {
    if (sample.time <= at(kFault)) continue;
    sample.angular_rate += fault.rate;
    sample.specific_force += fault.force;
  }
  for (GnssVelocity& velocity : log.gnss.velocities) {
    if (velocity.time > at(kFault)) velocity.velocity += fault.velocity;
  }
  for (GnssFix& fix : log.gnss.fixes) {
    fix.position += fault.ramp * std::max(0.0, fix.time.seconds() - kFault);
  }
  NavigatorOptions options;
  options.filter = FilterOptions::of(imu);
  options.filter.gravity = 9.8064;
  options.gnss_lever_arm = log.gnss.lever_arm.value_or(Vector3d::Zero());
  ReplayOptions replay_options;
  replay_options.from = at(27);
  Random random(seed);
  for (double t = 28.00356; t < truth.back().time.seconds(); t += 0.2) {
    const auto state = evaluation::truth_at(truth, at(t));
    if (!state) continue;
    replay_options.headings.push_back(
        {state->time, yaw_of(*state) + 2 * kDegree * random.normal(), 2 * kDegree});
    if (!fault.headings) break;
  }
  std::vector<Time> times;
  for (std::size_t i = 0; i < truth.size(); i += 20) {
    if (truth[i].time > at(57)) times.push_back(truth[i].time);
  }
  Navigator navigator(options);
  Outcome outcome;
  std::vector<double> errors;
  double good = 0;
  std::size_t next = 0;
  replay(log, navigator, replay_options, [&](Time now) {
    for (; next < times.size() && times[next] <= now; ++next) {
      const Time t2 = times[next];
      const Time t1{t2.nanoseconds - 100'000'000};
      const double since = t2.seconds() - kFault;
      const auto answer = navigator.relative_pose(t1, t2, Pose{});
      if (since > 0 && answer.status != NavigationStatus::navigating) {
        outcome.noticed = std::min(outcome.noticed, since);
      }
      if (answer.answer != Answer::valid || since < 15) continue;
      const auto error =
          evaluation::score({t1, t2, answer.motion, answer.scale_valid, answer.direction_valid}, truth);
      if (!error) continue;
      outcome.nees += error->nees;
      errors.push_back(error->translation);
      if (error->length > 0.1 * error->baseline) continue;
      ++good;
      outcome.flagged += answer.scale_valid;
    }
  });
  outcome.nees /= static_cast<double>(errors.size());
  outcome.worst = evaluation::quantile(errors, 0.95);
  outcome.flagged /= good;
  outcome.health = navigator.health();
  return outcome;
}

class Faults : public testing::TestWithParam<std::pair<const char*, ImuClass>> {
 protected:
  void SetUp() override {
    if (!fs::exists(kData)) GTEST_SKIP() << kData << " is not here";
    io::NavigationLogOptions options;
    options.gnss = GetParam().first;
    auto log = io::read_navigation_log(kData / "mav_mh01", options);
    ASSERT_TRUE(log.ok());
    log_ = *log;
  }
  Outcome shown(const Fault& fault) {
    const Outcome o = fly(log_, fault, GetParam().second, 1);
    std::printf(
        "%.8s %-10s %-24s noticed after %.1f s; from 15 s on NEES %.2f, 95 %% %.2f cm, good pairs flagged "
        "%.2f; "
        "lost %d, velocities doubted %d, restarts %d\n",
        GetParam().first + 5, std::string(to_name(GetParam().second)).c_str(), fault.name.c_str(), o.noticed,
        o.nees, 100 * o.worst, o.flagged, static_cast<int>(o.health.times_lost),
        static_cast<int>(o.health.velocity_doubted), static_cast<int>(o.health.restarts));
    return o;
  }

  NavigationLog log_;
};

TEST_P(Faults, OfTheGyroscopeAreNoticedAndOvercome) {
  for (const double size : {0.02, -0.02, 0.05, 0.2}) {
    for (int axis = 0; axis < 3; ++axis) {
      Fault fault;
      fault.rate[axis] = size;
      fault.headings = axis == 2;
      fault.name = named("gyroscope", axis, size);
      const Outcome outcome = shown(fault);
      EXPECT_LT(outcome.noticed, axis == 2 ? 15 : 3.05) << fault.name;
      EXPECT_LT(outcome.nees, 5) << fault.name;
      EXPECT_GT(outcome.flagged, 0.7) << fault.name;
    }
  }
}

TEST_P(Faults, OfTheAccelerometerAreNoticedAndOvercome) {
  for (const double size : {1.0, 3.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Fault fault;
      fault.force[axis] = size;
      fault.name = named("accelerometer", axis, size);
      const Outcome outcome = shown(fault);
      EXPECT_LT(outcome.noticed, 3.05) << fault.name;
      EXPECT_LT(outcome.nees, 5) << fault.name;
    }
  }
}

TEST_P(Faults, OfTheGnssAreNoticed) {
  for (const double size : {0.5, 2.0, 7.5}) {
    Fault velocity;
    velocity.name = "velocity " + std::to_string(size).substr(0, 3);
    velocity.velocity = {size, 0, 0};
    const Outcome wrong_velocity = shown(velocity);
    EXPECT_LT(wrong_velocity.noticed, 3.05) << size;
    EXPECT_GE(wrong_velocity.health.velocity_doubted, 1U) << size;
    EXPECT_LT(wrong_velocity.nees, 5) << size;
    Fault positions;
    positions.name = "positions drift " + std::to_string(size).substr(0, 3);
    positions.ramp = {size, 0, 0};
    const Outcome wrong_positions = shown(positions);
    EXPECT_LT(wrong_positions.noticed, size < 1 ? 6 : 3.05) << size;
    EXPECT_LT(wrong_positions.nees, 5) << size;
  }
}

TEST(NoFaults, TheOtherRecordingsAreNeverLost) {
  if (!fs::exists(kData)) GTEST_SKIP() << kData << " is not here";
  for (const bool car : {true, false}) {
    const auto log = io::read_navigation_log(kData / (car ? "car_drive_rtk" : "quad_px4_flow"), {});
    ASSERT_TRUE(log.ok());
    for (const bool second : {false, true}) {  // the car on its wheels, the quadrotor as of the other class
      NavigatorOptions options;
      options.filter = FilterOptions::of(car || second ? ImuClass::consumer : ImuClass::industrial);
      options.gnss_position_latency = car ? -0.1 : 0;
      ReplayOptions replay_options;
      replay_options.road_rate = car && second ? 5 : 0;
      Navigator navigator(options);
      replay(*log, navigator, replay_options, nullptr);
      const Health health = navigator.health();
      std::printf("%s: %.0f s, lost %d times, velocities doubted %d times, restarts %d\n",
                  car ? "car" : "quadrotor", seconds_between(log->imu.front().time, log->imu.back().time),
                  static_cast<int>(health.times_lost), static_cast<int>(health.velocity_doubted),
                  static_cast<int>(health.restarts));
      EXPECT_EQ(health.times_lost, 0U);
      EXPECT_EQ(health.velocity_doubted, 0U);
      EXPECT_EQ(health.restarts, 0U);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Recordings, Faults,
                         testing::Values(std::pair{"gnss_spp_5hz.csv", ImuClass::consumer},
                                         std::pair{"gnss_spp_5hz.csv", ImuClass::industrial},
                                         std::pair{"gnss_rtk_5hz.csv", ImuClass::consumer},
                                         std::pair{"gnss_rtk_5hz.csv", ImuClass::industrial}));

}  // namespace
}  // namespace pade::navigation
