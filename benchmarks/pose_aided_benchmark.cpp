// Pose-aided Lucas-Kanade and CLG against their own two-dimensional forms, time and median error:
//   build/benchmarks/pade_benchmarks --benchmark_filter=pose_aided
// Scenes: Middlebury's Venus (camera moved along x without rotation; needs ../shared/data/flow, or
// PADE_FLOW_DATA in the environment) and an analytic flight along the optical axis with noise of 4 grey
// levels.
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "pade/core/compute/simd.hpp"
#include "pade/flow/epipolar/epipolar.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/io/formats/flow_file.hpp"
#include "pade/io/image/image_codec.hpp"

#include "flow/epipolar/forward_flight.hpp"

namespace {

struct Scene {
  cv::Mat first, second, truth;
  pade::flow::EpipolarField lines;
};

std::optional<Scene> venus() {
  const char* given = std::getenv("PADE_FLOW_DATA");
  const std::filesystem::path folder =
      std::filesystem::path(given != nullptr ? given : PADE_SOURCE_DIR "/../shared/data/flow") /
      "middlebury/Venus";
  Scene scene;
  const auto first = pade::io::load_image(folder / "frame10.png", pade::io::Pixels::grey);
  const auto second = pade::io::load_image(folder / "frame11.png", pade::io::Pixels::grey);
  const auto truth = pade::io::read_flow(folder / "flow10.flo");
  if (!first || !second || !truth) return std::nullopt;
  scene.first = *first;
  scene.second = *second;
  scene.truth = *truth;
  scene.lines.direction = cv::Mat(scene.first.size(), CV_32FC2, cv::Scalar(1, 0));
  return scene;
}

std::optional<Scene> forward_flight() {
  constexpr int kScale = 2;
  constexpr double kNoise = 4;
  const pade::flow::testing::ForwardFlight flight(kScale, kNoise);
  return Scene{flight.first, flight.second, flight.truth, flight.lines};
}

// Processor time of this thread, which other programs on the machine disturb least.
double seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

template <class Work>
double seconds_of(const Work& work) {
  const double start = seconds();
  work();
  return seconds() - start;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Both forms take turns, so that a disturbed machine disturbs both alike.
void pose_aided(benchmark::State& state, const std::string& name, std::optional<Scene> (*make_scene)()) {
  const std::optional<Scene> scene = make_scene();
  if (!scene) return state.SkipWithError("the images of Venus are not there");
  cv::setNumThreads(1);
  const auto own = pade::flow::make_flow_estimator(name);
  const auto aided =
      name == "lucas-kanade" ? pade::flow::make_epipolar_lucas_kanade() : pade::flow::make_epipolar_clg();
  cv::Mat own_vectors;
  cv::Mat aided_vectors;
  std::vector<double> own_times;
  std::vector<double> aided_times;
  for (auto _ : state) {
    own_times.push_back(
        seconds_of([&] { own_vectors = (*own)->estimate(scene->first, scene->second).vectors; }));
    aided_times.push_back(seconds_of(
        [&] { aided_vectors = aided->estimate(scene->first, scene->second, scene->lines).flow.vectors; }));
    state.SetIterationTime(aided_times.back());
  }
  const double own_error = pade::flow::testing::median_error(own_vectors, scene->truth, 0);
  const double aided_error = pade::flow::testing::median_error(aided_vectors, scene->truth, 0);
  state.counters["ms_2d"] = 1e3 * median(own_times);
  state.counters["ms_aided"] = 1e3 * median(aided_times);
  state.counters["time_ratio"] = median(aided_times) / median(own_times);
  state.counters["px_2d"] = own_error;
  state.counters["px_aided"] = aided_error;
  state.counters["error_ratio"] = aided_error / own_error;
  state.SetLabel(std::string(pade::simd::name(pade::simd::best())));
}

const int registered = [] {
  for (const std::string name : {"lucas-kanade", "clg-fast"}) {
    for (const auto& [scene, make] :
         {std::pair{"venus", &venus}, std::pair{"forward_flight", &forward_flight}}) {
      benchmark::RegisterBenchmark(("pose_aided/" + name + "/" + scene).c_str(), pose_aided, name, make)
          ->Unit(benchmark::kMillisecond)
          ->UseManualTime();
    }
  }
  return 0;
}();

}  // namespace
