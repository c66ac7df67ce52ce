// What noise of 5 % of the depth, with its sigma known, does to the map, beside OctoMap with its defaults on
// the same depth: solids that are marked free, obstacles that are there, the volume that is known.
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/mapping/back_projection.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;
using simulation::AnalyticFlight;

constexpr double kNoise = 0.05;
constexpr double kRange = 12;

struct NoisyQuality {
  double solid_free = 0;  ///< of the free voxels, those whose centre lies in a solid
  double recalled = 0;    ///< of the surface seen, what has an occupied voxel within one voxel
  double volume = 0;      ///< known, m³
};

using StateAt = std::function<Occupancy(const Vector3d&)>;

double recall(const AnalyticFlight& flight, double voxel, const StateAt& at) {
  std::size_t seen = 0;
  std::size_t found = 0;
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    const Pose& T = flight.T_world_camera[k];
    for (const CloudPoint& point : back_project(depth_image(flight, k), flight.camera, T, {}, 3)) {
      const Vector3d p(point.x, point.y, point.z);
      if ((T.inverse() * p).z() > kRange) continue;
      ++seen;
      bool near = false;
      for (int i = 0; i < 27 && !near; ++i) {
        const Vector3d step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);  // NOLINT(bugprone-integer-division)
        near = at(p + voxel * step) == Occupancy::occupied;
      }
      found += near ? 1 : 0;
    }
  }
  return static_cast<double>(found) / static_cast<double>(seen);
}

/// Adds up cubes of free and occupied voxels.
class Volume {
 public:
  explicit Volume(const AnalyticFlight& flight, double voxel) : flight_(flight), voxel_(voxel) {}
  void add(const Vector3d& centre, double side, bool occupied) {
    const int n = static_cast<int>(std::lround(side / voxel_));
    known_ += static_cast<std::size_t>(n) * n * n;
    if (occupied) return;
    for (int i = 0; i < n * n * n; ++i) {
      const Vector3d offset(i % n, i / n % n, i / (n * n));  // NOLINT(bugprone-integer-division)
      ++free_;
      solid_ += flight_.scene.inside_solid(centre + voxel_ * (offset - Vector3d::Constant(0.5 * (n - 1))));
    }
  }
  [[nodiscard]] double solid_free() const {
    return static_cast<double>(solid_) / static_cast<double>(std::max<std::size_t>(free_, 1));
  }
  [[nodiscard]] double known() const { return static_cast<double>(known_) * std::pow(voxel_, 3); }

 private:
  const AnalyticFlight& flight_;
  double voxel_;
  std::size_t known_ = 0, free_ = 0, solid_ = 0;
};

NoisyQuality ours(const AnalyticFlight& flight) {
  MapOptions options;
  options.range = kRange;
  const OccupancyMap map = map_of(flight, kNoise, options);
  Volume volume(flight, options.voxel);
  map.for_each([&](const MapCell& cell, Occupancy state) {
    volume.add(cell.centre.cast<double>(), static_cast<double>(cell.side), state == Occupancy::occupied);
  });
  return {volume.solid_free(), recall(flight, options.voxel, [&](const Vector3d& p) { return map.at(p); }),
          volume.known()};
}

NoisyQuality octomaps(const AnalyticFlight& flight) {
  const double voxel = MapOptions{}.voxel;
  octomap::OcTree tree(voxel);
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    octomap::Pointcloud cloud;
    const Pose& T = flight.T_world_camera[k];
    for (const CloudPoint& p : back_project(depth_image(flight, k, kNoise), flight.camera, T)) {
      if ((T.inverse() * Vector3d(p.x, p.y, p.z)).z() <= kRange) cloud.push_back(p.x, p.y, p.z);
    }
    const Eigen::Vector3f eye = T.translation.cast<float>();
    tree.insertPointCloud(cloud, octomap::point3d(eye.x(), eye.y(), eye.z()));
  }
  Volume volume(flight, voxel);
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    volume.add({static_cast<double>(leaf.getX()), static_cast<double>(leaf.getY()),
                static_cast<double>(leaf.getZ())},
               leaf.getSize(), tree.isNodeOccupied(*leaf));
  }
  const StateAt at = [&](const Vector3d& p) {
    const octomap::OcTreeNode* node = tree.search(p.x(), p.y(), p.z());
    if (node == nullptr) return Occupancy::unknown;
    return tree.isNodeOccupied(node) ? Occupancy::occupied : Occupancy::free;
  };
  return {volume.solid_free(), recall(flight, voxel, at), volume.known()};
}

class NoisyMap : public testing::TestWithParam<std::string> {};

TEST_P(NoisyMap, FreesNoSolidAndKnowsAsMuchAsOctoMap) {
  const AnalyticFlight flight =
      *simulation::make_analytic_flight(GetParam(), 15, simulation::analytic_camera(320, 240));
  const NoisyQuality own = ours(flight);
  const NoisyQuality theirs = octomaps(flight);
  std::printf(
      "%s: free voxels in solids %.3f %% (OctoMap %.3f), surface recalled %.2f %% (%.2f), known volume %.1f "
      "m3 "
      "(%.1f): %.1f %%\n",
      GetParam().c_str(), 100 * own.solid_free, 100 * theirs.solid_free, 100 * own.recalled,
      100 * theirs.recalled, own.volume, theirs.volume, 100 * own.volume / theirs.volume);
  EXPECT_LE(own.solid_free, 0.01);
  EXPECT_GE(own.recalled,
            0.6);  // what is not certain to a voxel waits for looks that agree (docs/mapping.md)
  EXPECT_GE(own.volume, 0.84 * theirs.volume);
}

INSTANTIATE_TEST_SUITE_P(Flights, NoisyMap, testing::Values("forward", "sideways", "turning", "courtyard"),
                         [](const auto& flight) { return flight.param; });

}  // namespace
}  // namespace pade::mapping
