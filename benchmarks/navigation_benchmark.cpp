// Cost of the navigation filter per IMU sample, beside a calibration kernel that says how fast this core is.
#include <cmath>

#include <benchmark/benchmark.h>

#include "pade/navigation/filter.hpp"
#include "pade/navigation/navigator.hpp"

#include "../tests/navigation/flight.hpp"

namespace pade::navigation {
namespace {

const NavigationLog& flight() {
  static const NavigationLog log =
      record(Flight{}, 60, simulation::ImuModel::industrial(), simulation::GnssModel::single_point(), 1);
  return log;
}

void per_sample(benchmark::State& state) {
  state.counters["per_sample"] =
      benchmark::Counter(static_cast<double>(flight().imu.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// Calibration: a chain of dependent square roots (7.5 ns a step where 0.83 µs per sample was measured).
void CalibrationSquareRoots(benchmark::State& state) {
  double x = 2;
  for (auto _ : state) benchmark::DoNotOptimize(x = std::sqrt(x + 1));
}
BENCHMARK(CalibrationSquareRoots);

/// Two clones in the state, both renewed at 10 Hz; GNSS position and velocity at 5 Hz.
void FilterWithTwoClones(benchmark::State& state) {
  const NavigationLog& log = flight();
  for (auto _ : state) {
    Filter filter(FilterOptions{}, Vector3d::Zero());
    NavigationState start;
    start.X.R = log.truth[0].T_world_body.rotation;
    start.X.p = log.truth[0].T_world_body.translation;
    filter.start(start, 0.01 * BaseMatrix::Identity());
    std::size_t epoch = 1;
    for (std::size_t i = 1; i < log.imu.size(); ++i) {
      const ImuSample& a = log.imu[i - 1];
      const ImuSample& b = log.imu[i];
      filter.propagate(b.time, 0.5 * (a.angular_rate + b.angular_rate),
                       0.5 * (a.specific_force + b.specific_force), b.angular_rate);
      if (epoch < log.gnss.fixes.size() && log.gnss.fixes[epoch].time <= b.time) {
        filter.update(log.gnss.velocities[epoch]);
        filter.update(log.gnss.fixes[epoch++]);
      }
      if (i % 20 == 1) {
        filter.drop_clones();
        filter.clone();
        filter.clone();
      }
    }
    benchmark::DoNotOptimize(filter.state().X.p);
  }
  per_sample(state);
}
BENCHMARK(FilterWithTwoClones)->Unit(benchmark::kMillisecond);

/// Everything: ordering, keyframes, and a relative pose over 0.1 s asked at 10 Hz.
void NavigatorWithRelativePoses(benchmark::State& state) {
  const NavigationLog& log = flight();
  for (auto _ : state) {
    Navigator navigator(NavigatorOptions{});
    navigator.add(Heading{Time::from_seconds(1), 0.7, 0.03});
    std::size_t epoch = 0;
    for (std::size_t i = 0; i < log.imu.size(); ++i) {
      while (epoch < log.gnss.fixes.size() && log.gnss.fixes[epoch].time <= log.imu[i].time) {
        navigator.add(log.gnss.velocities[epoch]);
        navigator.add(log.gnss.fixes[epoch++]);
      }
      navigator.add(log.imu[i]);
      if (i % 20 == 0 && i > 800) {
        benchmark::DoNotOptimize(navigator.relative_pose(log.imu[i - 20].time, log.imu[i].time, Pose{}));
      }
    }
  }
  per_sample(state);
}
BENCHMARK(NavigatorWithRelativePoses)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pade::navigation
