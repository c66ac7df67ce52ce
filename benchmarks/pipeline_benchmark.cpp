// Latency of one frame through the whole pipeline at 640 x 480: grey, derotation, flow, depth and map.
#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

#include "pade/pipeline/obstacle_mapper.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade {
namespace {

void AddFrame(benchmark::State& state, const char* flow) {
  cv::setNumThreads(1);
  constexpr int kFrames = 6;
  const auto flight = *simulation::make_analytic_flight("courtyard", kFrames);
  std::vector<cv::Mat> images;
  for (const Pose& pose : flight.T_world_camera) {
    images.push_back(simulation::render_image(flight.scene, flight.camera, pose));
  }
  ObstacleMapperOptions options;
  options.flow = flow;
  auto mapper = std::move(ObstacleMapper::create(flight.camera, options)).value();
  std::int64_t frame = 0;
  for (auto _ : state) {
    // To and fro along the flight, so that it never ends.
    const std::int64_t phase = frame % (2 * (kFrames - 1));
    const auto k = static_cast<std::size_t>(phase < kFrames ? phase : 2 * (kFrames - 1) - phase);
    benchmark::DoNotOptimize(mapper.add(images[k], Time{frame * 100'000'000}, flight.T_world_camera[k]));
    ++frame;
  }
}
BENCHMARK_CAPTURE(AddFrame, dis_ultrafast, "dis-ultrafast")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(AddFrame, dis_medium, "dis-medium")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pade
