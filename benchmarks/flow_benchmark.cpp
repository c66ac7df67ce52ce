// Time per 640 x 480 pair of every flow method, on one thread. The instruction set that ran is in the label.
// PADE_ISA=avx2 in the environment measures another one.
#include <algorithm>
#include <string>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "pade/core/compute/simd.hpp"
#include "pade/flow/epipolar/epipolar.hpp"
#include "pade/flow/flow_estimator.hpp"

namespace {

struct Pair {
  cv::Mat first, second;
};

// Smoothed noise, moved by (2.5, -1.25) pixels: texture everywhere, so that no method has an easy time.
const Pair& pair() {
  static const Pair images = [] {
    cv::Mat noise(480, 640, CV_32FC1);
    cv::theRNG().state = 1;
    cv::randu(noise, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 2.5);
    cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
    const cv::Matx23d shift(1, 0, 2.5, 0, 1, -1.25);
    cv::Mat moved;
    cv::warpAffine(noise, moved, shift, noise.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
    Pair result;
    noise.convertTo(result.first, CV_8U);
    moved.convertTo(result.second, CV_8U);
    return result;
  }();
  return images;
}

void flow(benchmark::State& state, const std::string& name, const pade::flow::FlowOptions& options) {
  cv::setNumThreads(1);
  const auto method = pade::flow::make_flow_estimator(name, options);
  for (auto _ : state)
    benchmark::DoNotOptimize((*method)->estimate(pair().first, pair().second).vectors.data);
  state.SetLabel(std::string(pade::simd::name(pade::simd::best())));
}

void stream(benchmark::State& state, const std::string& name) {
  const auto method = pade::flow::make_flow_estimator(name);
  (*method)->next(pair().second);
  bool odd = false;
  for (auto _ : state) {
    odd = !odd;
    benchmark::DoNotOptimize((*method)->next(odd ? pair().first : pair().second).vectors.data);
  }
  state.SetLabel(std::string(pade::simd::name(pade::simd::best())));
}

void epipolar(benchmark::State& state, bool clg) {
  pade::flow::EpipolarField lines;
  lines.direction = cv::Mat(pair().first.size(), CV_32FC2, cv::Scalar(0.894, -0.447));
  const auto method = clg ? pade::flow::make_epipolar_clg() : pade::flow::make_epipolar_lucas_kanade();
  for (auto _ : state)
    benchmark::DoNotOptimize(method->estimate(pair().first, pair().second, lines).distance.data);
  state.SetLabel(std::string(pade::simd::name(pade::simd::best())));
}

const int registered = [] {
  for (const std::string& name : pade::flow::flow_estimator_names()) {
    if (name == "opencv-pyrlk") continue;  // seconds
    benchmark::RegisterBenchmark(("flow/" + name).c_str(), flow, name, pade::flow::FlowOptions{})
        ->Unit(benchmark::kMillisecond);
  }
  for (const std::string name : {"lucas-kanade", "farneback", "clg-fast", "clg-accurate"}) {
    pade::flow::FlowOptions two_threads;
    two_threads.threads = 2;
    benchmark::RegisterBenchmark(("flow_two_threads/" + name).c_str(), flow, name, two_threads)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
    benchmark::RegisterBenchmark(("flow_stream/" + name).c_str(), stream, name)
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::RegisterBenchmark("flow_epipolar/lucas-kanade", epipolar, false)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("flow_epipolar/clg-fast", epipolar, true)->Unit(benchmark::kMillisecond);
  return 0;
}();

}  // namespace
