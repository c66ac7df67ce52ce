// Time of the depth step at 640 x 480, from given flow to depth, variance and state, against a memcpy of the
// same bytes in the same run.
#include <cstring>
#include <vector>

#include <benchmark/benchmark.h>

#include "pade/depth/depth_estimator.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::depth {
namespace {

/// A pair of frames of the facade scene, forward with yaw.
struct Pair {
  simulation::AnalyticFlight flight = *simulation::make_analytic_flight("turning", 2);
  RelativeMotion motion = relative_motion(flight.T_world_camera[1], flight.T_world_camera[0], -0.1);
  FlowField flow =
      simulation::exact_flow(flight.scene, flight.camera, flight.T_world_camera[1], flight.T_world_camera[0])
          .flow;
  cv::Mat newest = simulation::render_image(flight.scene, flight.camera, flight.T_world_camera[1]);
  cv::Mat older = simulation::render_image(flight.scene, flight.camera, flight.T_world_camera[0]);
};
const Pair& pair() {
  static const Pair made;
  return made;
}

/// Flow in (8 bytes per pixel), depth, variance (4 each) and state (1) out: copies as many bytes.
void Memcpy(benchmark::State& state) {
  const std::size_t bytes = std::size_t{640} * 480 * (8 + 4 + 4 + 1);
  std::vector<char> from(bytes, 1);
  std::vector<char> to(bytes);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), bytes);
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(Memcpy)->Unit(benchmark::kMicrosecond);

void estimate(benchmark::State& state, const DepthOptions& options, bool images) {
  const Pair& p = pair();
  DepthEstimator estimator(options);
  DepthImage depth;
  DepthInput input{p.flight.camera, p.motion, p.flow};
  const cv::Mat turned = derotate_image(p.older, p.flight.camera, p.motion);
  if (images) {
    input.reference = p.newest;
    input.other = turned;
  }
  for (auto _ : state) {
    estimator.estimate(input, depth);
    benchmark::DoNotOptimize(depth.depth.data);
  }
}

void Pade(benchmark::State& state) {
  DepthOptions options;
  options.window = static_cast<int>(state.range(0));
  estimate(state, options, false);
}
BENCHMARK(Pade)->Arg(1)->Arg(4)->Arg(8)->Unit(benchmark::kMicrosecond);

void PadeInstantaneousSamelson(benchmark::State& state) {
  DepthOptions options;
  options.window = static_cast<int>(state.range(0));
  options.model = Model::instantaneous;
  options.reading = Reading::samelson;
  estimate(state, options, false);
}
BENCHMARK(PadeInstantaneousSamelson)->Arg(1)->Arg(4)->Unit(benchmark::kMicrosecond);

void Ttc(benchmark::State& state) {
  DepthOptions options;
  options.method = Method::ttc;
  options.window = static_cast<int>(state.range(0));
  estimate(state, options, false);
}
BENCHMARK(Ttc)->Arg(1)->Arg(4)->Unit(benchmark::kMicrosecond);

/// With the state "no texture" from the two images, as the pipeline runs it.
void PadeWithTexture(benchmark::State& state) {
  DepthOptions options;
  options.window = static_cast<int>(state.range(0));
  estimate(state, options, true);
}
BENCHMARK(PadeWithTexture)->Arg(1)->Arg(4)->Unit(benchmark::kMicrosecond);

void DerotateImage(benchmark::State& state) {
  const Pair& p = pair();
  for (auto _ : state) benchmark::DoNotOptimize(derotate_image(p.older, p.flight.camera, p.motion));
}
BENCHMARK(DerotateImage)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace pade::depth
