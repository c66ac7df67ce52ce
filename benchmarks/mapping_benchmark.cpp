// How long one depth image of 640 x 480, whole or in windows, takes to enter the map, beside OctoMap's own
// insertPointCloud on the same depth: range 20 m, in a map that has seen the flight before and in an empty
// one.
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/mapping/back_projection.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::mapping {
namespace {

constexpr int kFrames = 10;

struct Flown {
  simulation::AnalyticFlight flight;
  std::vector<DepthImage> images;
};

/// Depth with noise of 1 % of Z, which the variance states.
const Flown& flown_at_full_size() {
  static const Flown data = [] {
    Flown made{*simulation::make_analytic_flight("courtyard", kFrames), {}};
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (const Pose& pose : made.flight.T_world_camera) {
      DepthImage image;
      image.depth = simulation::exact_depth(made.flight.scene, made.flight.camera, pose);
      image.variance = 1e-4 * image.depth.mul(image.depth);
      for (int v = 0; v < image.depth.rows; ++v) {
        for (int u = 0; u < image.depth.cols; ++u) {
          image.depth.at<float>(v, u) *= static_cast<float>(1 + 0.01 * normal(random));
        }
      }
      image.state = cv::Mat(image.depth.size(), CV_8UC1, cv::Scalar(0));
      image.state.setTo(static_cast<int>(DepthState::no_texture), image.depth != image.depth);
      made.images.push_back(std::move(image));
    }
    return made;
  }();
  return data;
}

/// Every n-th pixel as the depth of a window of n x n.
const Flown& flown(int window = 1) {
  static std::map<int, Flown> all;
  if (window == 1) return flown_at_full_size();
  const auto [entry, is_new] = all.try_emplace(window, flown_at_full_size());
  if (!is_new) return entry->second;
  for (DepthImage& image : entry->second.images) {
    image.window = window;
    for (cv::Mat* part : {&image.depth, &image.variance, &image.state}) {
      cv::Mat cells(part->rows / window, part->cols / window, part->type());
      for (int v = 0; v < cells.rows; ++v) {
        for (int u = 0; u < cells.cols; ++u)
          (*part)(cv::Rect(u * window + window / 2, v * window + window / 2, 1, 1))
              .copyTo(cells(cv::Rect(u, v, 1, 1)));
      }
      *part = cells;
    }
  }
  return entry->second;
}

MapOptions options_of(benchmark::State& state) {
  MapOptions options;
  options.voxel = 0.01 * static_cast<double>(state.range(2));
  return options;
}

void MapIntegrate(benchmark::State& state) {
  const Flown& data = flown(static_cast<int>(state.range(1)));
  const bool fresh = state.range(0) != 0;
  OccupancyMap map = std::move(OccupancyMap::create(options_of(state))).value();
  const auto frame = [&](int k) {
    const auto i = static_cast<std::size_t>(k % kFrames);
    benchmark::DoNotOptimize(
        map.integrate(data.images[i], data.flight.camera, data.flight.T_world_camera[i]));
  };
  for (int k = 0; k < 5 * kFrames; ++k) frame(k);
  int k = 0;
  for (auto _ : state) {
    if (fresh) {
      state.PauseTiming();
      map = std::move(OccupancyMap::create(options_of(state))).value();
      state.ResumeTiming();
    }
    frame(k++);
  }
  state.counters["MB"] = static_cast<double>(map.memory()) * 1e-6;
}
BENCHMARK(MapIntegrate)
    ->ArgNames({"empty", "window", "cm"})
    ->Args({0, 1, 10})
    ->Args({1, 1, 10})
    ->Args({0, 4, 10})
    ->Args({0, 8, 10})
    ->Args({0, 1, 5})
    ->Unit(benchmark::kMillisecond);

void OctoMapInsertPointCloud(benchmark::State& state) {
  const Flown& data = flown(static_cast<int>(state.range(1)));
  const bool fresh = state.range(0) != 0;
  const bool discretize = state.range(3) != 0;
  std::vector<octomap::Pointcloud> clouds;
  for (std::size_t i = 0; i < kFrames; ++i) {
    octomap::Pointcloud& cloud = clouds.emplace_back();
    for (const CloudPoint& p :
         back_project(data.images[i], data.flight.camera, data.flight.T_world_camera[i])) {
      cloud.push_back(p.x, p.y, p.z);
    }
  }
  octomap::OcTree tree(options_of(state).voxel);
  const auto frame = [&](int k) {
    const auto i = static_cast<std::size_t>(k % kFrames);
    const Eigen::Vector3f eye = data.flight.T_world_camera[i].translation.cast<float>();
    tree.insertPointCloud(clouds[i], octomap::point3d(eye.x(), eye.y(), eye.z()), 20, false, discretize);
  };
  for (int k = 0; k < kFrames; ++k) frame(k);
  int k = 0;
  for (auto _ : state) {
    if (fresh) {
      state.PauseTiming();
      tree.clear();
      state.ResumeTiming();
    }
    frame(k++);
  }
  state.counters["MB"] = static_cast<double>(tree.memoryUsage()) * 1e-6;
}
BENCHMARK(OctoMapInsertPointCloud)
    ->ArgNames({"empty", "window", "cm", "discretize"})
    ->Args({0, 1, 10, 0})
    ->Args({1, 1, 10, 0})
    ->Args({0, 4, 10, 0})
    ->Args({0, 8, 10, 0})
    ->Args({0, 1, 5, 0})
    ->Args({0, 1, 10, 1})
    ->Unit(benchmark::kMillisecond);

void BackProject(benchmark::State& state) {
  const Flown& data = flown();
  for (auto _ : state) {
    benchmark::DoNotOptimize(back_project(data.images[0], data.flight.camera, data.flight.T_world_camera[0]));
  }
}
BENCHMARK(BackProject)->Unit(benchmark::kMillisecond);

void EncodeMap(benchmark::State& state) {
  const Flown& data = flown();
  OccupancyMap map = std::move(OccupancyMap::create()).value();
  for (std::size_t i = 0; i < kFrames; ++i) {
    map.integrate(data.images[i], data.flight.camera, data.flight.T_world_camera[i]);
  }
  for (auto _ : state) benchmark::DoNotOptimize(io::bytes_of(io::encode_map(map, io::MapFormat::bt)));
}
BENCHMARK(EncodeMap)->Unit(benchmark::kMillisecond);

void RenderAnalyticImage(benchmark::State& state) {
  const Flown& data = flown();
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        simulation::render_image(data.flight.scene, data.flight.camera, data.flight.T_world_camera[0]));
  }
}
BENCHMARK(RenderAnalyticImage)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pade::mapping
