// What a planner asks of the map, beside the same by OctoMap's octree and dynamicEDT3D in the same run.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/surroundings.hpp"

#include "mapping/flown_map.hpp"

#ifdef PADE_HAS_DYNAMIC_EDT
#include <dynamicEDT3D/dynamicEDTOctomap.h>
#endif

namespace pade::mapping {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.45;
constexpr double kLength = 5;
constexpr std::size_t kPoints = 4096;

/// The courtyard after a flight through it.
struct Known {
  simulation::AnalyticFlight flight = *simulation::make_analytic_flight("courtyard", 10);
  OccupancyMap map = map_of(flight, 0.01);
  std::shared_ptr<const MapView> view = MapView::of(map);
  std::unique_ptr<octomap::OcTree> tree = map.octree();
  Vector3d middle = flight.T_world_camera[5].translation;
  std::vector<Vector3d> points;               // in known space
  std::vector<Vector3d> anywhere;             // nine of ten in unknown space
  std::vector<std::array<Vector3d, 2>> ways;  // of 5 m, most of them clear all along

  Known() {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(-1, 1);
    while (points.size() < kPoints || anywhere.size() < kPoints) {
      const double x = unit(random);
      const double y = unit(random);
      const Vector3d at = middle + 8 * Vector3d(x, y, 0.3 * unit(random));
      if (anywhere.size() < kPoints) anywhere.push_back(at);
      if (points.size() < kPoints && view->at(at) != Occupancy::unknown) points.push_back(at);
    }
    // Two thirds clear along the whole of it, as most that a planner looks at; the others as they come.
    while (ways.size() < 200) {
      const double x = unit(random);
      const double y = unit(random);
      const double z = unit(random);
      const Vector3d from = middle + 6 * Vector3d(x, y, 0.3 * z);
      const double angle = 3.2 * unit(random);
      const std::array<Vector3d, 2> way{from, from + kLength * Vector3d(std::cos(angle), std::sin(angle), 0)};
      if (ways.size() % 3 == 0 || !view->sweep(way, kRadius, UnknownSpace::blocked)) ways.push_back(way);
    }
  }
};
const Known& known() {
  static const Known data;
  return data;
}

const std::vector<Vector3d>& points_of(const benchmark::State& state) {
  return state.range(0) != 0 ? known().anywhere : known().points;
}

void PointQuery(benchmark::State& state) {
  const MapView& view = *known().view;
  const std::vector<Vector3d>& points = points_of(state);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(view.at(points[i++ % kPoints]));
}
BENCHMARK(PointQuery)->ArgName("anywhere")->Arg(0)->Arg(1);

void PointQueryByOctree(benchmark::State& state) {
  const octomap::OcTree& tree = *known().tree;
  const std::vector<Vector3d>& points = points_of(state);
  std::size_t i = 0;
  for (auto _ : state) {
    const Vector3d& p = points[i++ % kPoints];
    benchmark::DoNotOptimize(tree.search(p.x(), p.y(), p.z()));
  }
}
BENCHMARK(PointQueryByOctree)->ArgName("anywhere")->Arg(0)->Arg(1);

void SweptBall(benchmark::State& state) {
  const Known& data = known();
  std::size_t i = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        data.view->sweep(data.ways[i++ % data.ways.size()], kRadius, UnknownSpace::blocked));
}
BENCHMARK(SweptBall)->Unit(benchmark::kMicrosecond);

/// Asks the octree for each voxel near the way, once, in order along x, and ends at the first that is not
/// free.
bool clear_by_octree(const octomap::OcTree& tree, const std::array<Vector3d, 2>& way) {
  const double voxel = tree.getResolution();
  const Vector3d direction = (way[1] - way[0]).normalized();
  const Vector3d low = ((way[0].cwiseMin(way[1]).array() - kRadius) / voxel).floor();
  const Vector3d high = ((way[0].cwiseMax(way[1]).array() + kRadius) / voxel).floor();
  for (double x = low.x(); x <= high.x(); ++x) {
    for (double y = low.y(); y <= high.y(); ++y) {
      for (double z = low.z(); z <= high.z(); ++z) {
        const Vector3d centre = voxel * (Vector3d(x, y, z).array() + 0.5);
        const double s = std::clamp((centre - way[0]).dot(direction), 0.0, kLength);
        if ((centre - way[0] - s * direction).squaredNorm() >= kRadius * kRadius) continue;
        const octomap::OcTreeNode* node = tree.search(centre.x(), centre.y(), centre.z());
        if (node == nullptr || tree.isNodeOccupied(node)) return false;
      }
    }
  }
  return true;
}

void SweptBallByOctree(benchmark::State& state) {
  const Known& data = known();
  std::size_t i = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(clear_by_octree(*data.tree, data.ways[i++ % data.ways.size()]));
}
BENCHMARK(SweptBallByOctree)->Unit(benchmark::kMicrosecond);

Eigen::AlignedBox3d field_box() {
  const Vector3d half(4.95, 4.95, 1.95);  // with both ends 10 x 10 x 4 m
  return {known().middle - half, known().middle + half};
}

void Distances(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(DistanceField::of(*known().view, field_box(), UnknownSpace::free, 2));
}
BENCHMARK(Distances)->Unit(benchmark::kMillisecond);

#ifdef PADE_HAS_DYNAMIC_EDT
void DistancesByDynamicEdt(benchmark::State& state) {
  const Eigen::AlignedBox3f box = field_box().cast<float>();
  octomap::OcTree tree(*known().tree);
  for (auto _ : state) {
    DynamicEDTOctomap field(2, &tree, {box.min().x(), box.min().y(), box.min().z()},
                            {box.max().x(), box.max().y(), box.max().z()}, false);
    field.update();
    benchmark::DoNotOptimize(&field);
  }
}
BENCHMARK(DistancesByDynamicEdt)->Unit(benchmark::kMillisecond);
#endif

void Sectors(benchmark::State& state) {
  const Known& data = known();
  for (auto _ : state)
    benchmark::DoNotOptimize(sectors(*data.view, data.middle, 20, 0.5, 0.5, UnknownSpace::free));
}
BENCHMARK(Sectors)->Unit(benchmark::kMicrosecond);

void ViewOfTheWholeMap(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(MapView::of(known().map));
}
BENCHMARK(ViewOfTheWholeMap)->Unit(benchmark::kMillisecond);

void ViewAfterAFrame(benchmark::State& state) {
  const Known& data = known();
  OccupancyMap map = map_of(data.flight, 0.01);
  const auto view = MapView::of(map);
  const MapChange change =
      map.integrate(depth_image(data.flight, 5, 0.01), data.flight.camera, data.flight.T_world_camera[5]);
  for (auto _ : state) benchmark::DoNotOptimize(view->after(map, change));
  state.counters["touched"] = static_cast<double>(change.touched.size());
}
BENCHMARK(ViewAfterAFrame)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace pade::mapping
