// The simulator at 640 x 480 in the five shipped kinds of world: depth alone, a finished frame (4 rays per
// pixel, shadow, ambient occlusion, sensor noise), preview. Beside a calibration kernel, so that the figures
// can be compared between machines. CPU time is the figure: it does not count the neighbours on a shared
// machine.
//   ./build/benchmarks/pade_benchmarks --benchmark_filter=Simulation
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "pade/simulation/generator/paper_set.hpp"
#include "pade/simulation/render/image_formation.hpp"
#include "pade/simulation/render/renderer.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

/// A world with a camera that has flown through some of it, so that ambient occlusion is as warm as in a
/// sequence.
struct Stage {
  std::unique_ptr<Scene> scene;
  std::unique_ptr<Renderer> renderer;
  std::vector<CameraStation> stations;
};

Camera paper_camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 554.26;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

Stage build_stage(std::size_t index) {
  Stage stage;
  const auto kind = static_cast<WorldKind>(index);
  const auto folder =
      std::filesystem::temp_directory_path() / ("pade_benchmark_" + std::to_string(::getpid()));
  const auto file = folder / (std::string(to_name(kind)) + ".sdf");
  if (!write_world(generate_world(kind, 1), file)) return stage;
  auto world = read_sdf(file);
  std::filesystem::remove_all(folder);
  if (!world) return stage;
  auto scene = Scene::build(std::move(world).value());
  if (!scene) return stage;
  stage.scene = std::make_unique<Scene>(std::move(scene).value());
  stage.renderer = std::make_unique<Renderer>(*stage.scene);
  for (const PaperSequence& sequence : paper_sequences(1)) {
    if (sequence.world != kind || (kind == WorldKind::building && sequence.name != "approach")) continue;
    const auto path = Trajectory::through(sequence.flight.waypoints, sequence.flight.trajectory);
    auto stations =
        camera_stations(sequence.flight, *path, {Eigen::Quaterniond(forward_camera_rotation()), {0, 0, 0}});
    stage.stations.assign(stations->begin() + 40, stations->begin() + 48);
    break;
  }
  const RayGrid grid(paper_camera());
  for (const CameraStation& station : stage.stations) {
    benchmark::DoNotOptimize(stage.renderer->render(grid, station.T_world_camera, {}));
  }
  return stage;
}

const Stage& stage(std::size_t index) {
  static std::map<std::size_t, Stage> stages;
  auto known = stages.find(index);
  if (known == stages.end()) known = stages.emplace(index, build_stage(index)).first;
  return known->second;
}

/// Runs `work(stage, grid, pose)` over the stations in turn.
template <class Work>
void over_stations(benchmark::State& state, const Work& work) {
  const auto index = static_cast<std::size_t>(state.range(0));
  const Stage& place = stage(index);
  if (!place.scene || place.stations.empty()) {
    state.SkipWithError("the world could not be made");
    return;
  }
  state.SetLabel(std::string(to_name(static_cast<WorldKind>(index))));
  const RayGrid grid(paper_camera());
  std::size_t i = 0;
  for (auto _ : state) work(place, grid, place.stations[i++ % place.stations.size()].T_world_camera);
}

/// 2^24 dependent multiplications and additions in double: a few cycles each, no memory.
void SimulationCalibration(benchmark::State& state) {
  for (auto _ : state) {
    double x = 1;
    double factor = 0.999999999;
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(factor);
    for (int i = 0; i < (1 << 24); ++i) x = x * factor + 1e-9;
    benchmark::DoNotOptimize(x);
  }
}
BENCHMARK(SimulationCalibration)->Unit(benchmark::kMillisecond);

void SimulationDepth(benchmark::State& state) {
  over_stations(state, [](const Stage& place, const RayGrid& grid, const Pose& pose) {
    benchmark::DoNotOptimize(exact_depth(*place.scene, grid, pose));
  });
}
BENCHMARK(SimulationDepth)->DenseRange(0, 4)->Unit(benchmark::kMillisecond);

void SimulationFrame(benchmark::State& state) {
  over_stations(state, [](const Stage& place, const RayGrid& grid, const Pose& pose) {
    const Rendering rendering = place.renderer->render(grid, pose, {});
    benchmark::DoNotOptimize(form_image(rendering.radiance, grid, {}, 0, 1, 1));
  });
}
BENCHMARK(SimulationFrame)->DenseRange(0, 4)->Unit(benchmark::kMillisecond);

/// By the clock on the wall, with 1 and 2 threads: only on an idle machine does the ratio mean anything.
void SimulationFrameThreads(benchmark::State& state) {
  const auto threads = static_cast<int>(state.range(1));
  over_stations(state, [threads](const Stage& place, const RayGrid& grid, const Pose& pose) {
    const Rendering rendering = place.renderer->render(grid, pose, {}, threads);
    benchmark::DoNotOptimize(form_image(rendering.radiance, grid, {}, 0, 1, 1, threads));
  });
}
BENCHMARK(SimulationFrameThreads)->ArgsProduct({{1}, {1, 2}})->UseRealTime()->Unit(benchmark::kMillisecond);

void SimulationPreview(benchmark::State& state) {
  over_stations(state, [](const Stage& place, const RayGrid& grid, const Pose& pose) {
    const Rendering rendering = place.renderer->render(grid, pose, RenderOptions::preview());
    benchmark::DoNotOptimize(form_image(rendering.radiance, grid, {}, 0, 1, 1));
  });
}
BENCHMARK(SimulationPreview)->DenseRange(0, 4)->Unit(benchmark::kMillisecond);

void SimulationFlow(benchmark::State& state) {
  over_stations(state, [](const Stage& place, const RayGrid& grid, const Pose& pose) {
    const cv::Mat depth = exact_depth(*place.scene, grid, pose);
    benchmark::DoNotOptimize(
        exact_flow(*place.scene, grid, depth, pose, place.stations.back().T_world_camera));
  });
}
BENCHMARK(SimulationFlow)->DenseRange(0, 4)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pade::simulation
