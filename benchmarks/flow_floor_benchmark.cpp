// What the machine can do at best, and what the loops of the flow methods do: the floor that docs/flow.md
// compares with. Items are vector lanes of arithmetic, or pixels.
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "pade/core/compute/simd.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/pyramid/plane.hpp"
#include "pade/flow/pyramid/pyramid.hpp"

#include "floor_kernels.hpp"

namespace {

using namespace pade::flow;  // the kernels' namespaces

constexpr int kWidth = 640;
constexpr int kHeight = 480;

void finish(benchmark::State& state, double items) {
  state.counters["per_item"] =
      benchmark::Counter(items, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.SetLabel(std::string(pade::simd::name(pade::simd::best())));
}

void arithmetic(benchmark::State& state) {
  constexpr long kRepetitions = 10000;
  const auto isa = pade::simd::best();
  std::vector<float> result(64);
  for (auto _ : state) {
    PADE_DISPATCH(floor_arithmetic, isa)(kRepetitions, result.data());
    benchmark::DoNotOptimize(result.data());
  }
  finish(state, static_cast<double>(kRepetitions * kFloorOperations * PADE_DISPATCH(floor_lanes, isa)()));
}

void memory(benchmark::State& state) {
  Plane a(kWidth, kHeight);
  Plane b(kWidth, kHeight);
  Plane to(kWidth, kHeight);
  for (auto _ : state) {
    PADE_DISPATCH(floor_memory, pade::simd::best())
    (a.data(), b.data(), to.data(), static_cast<long>(kWidth) * kHeight);
    benchmark::DoNotOptimize(to.data());
  }
  finish(state, kWidth * kHeight);
}

// Texture, so that no branch or value is special.
Plane noise() {
  Plane plane(kWidth, kHeight);
  unsigned state = 1;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      state = state * 1664525U + 1013904223U;
      plane.row(y)[x] = static_cast<float>(state >> 24U);
    }
  }
  return plane;
}

void window(benchmark::State& state) {
  const auto radius = static_cast<int>(state.range(0));
  const Plane from = noise();
  Plane to(kWidth, kHeight);
  const std::vector<float> taps = gaussian_taps(0.5 * radius, radius);
  AlignedFloats scratch(kPlaneLines * (kWidth + 2 * kRowMultiple));
  for (auto _ : state) {
    PADE_DISPATCH(smooth, pade::simd::best())
    (from.view(), to.view(), taps.data(), radius, 0, kHeight, scratch.data());
    benchmark::DoNotOptimize(to.data());
  }
  finish(state, kWidth * kHeight);
}

void median(benchmark::State& state) {
  const Plane from = noise();
  Plane to(kWidth, kHeight);
  AlignedFloats scratch(kPlaneLines * (kWidth + 2 * kRowMultiple));
  for (auto _ : state) {
    PADE_DISPATCH(median5, pade::simd::best())(from.view(), to.view(), 0, kHeight, scratch.data());
    benchmark::DoNotOptimize(to.data());
  }
  finish(state, kWidth * kHeight);
}

BENCHMARK(arithmetic)->Name("flow_floor/arithmetic")->Unit(benchmark::kMillisecond);
BENCHMARK(memory)->Name("flow_floor/add_two_planes")->Unit(benchmark::kMillisecond);
BENCHMARK(window)->Name("flow_floor/window_of_radius")->Arg(4)->Arg(5)->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(median)->Name("flow_floor/median_5x5")->Unit(benchmark::kMillisecond);

}  // namespace
