#include "pade/mapping/occupancy_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "pade/mapping/back_projection.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;
using simulation::AnalyticFlight;
using simulation::make_analytic_flight;

struct Quality {
  double farthest_occupied = 0;  // distance of occupied voxel centres from the nearest surface, largest, m
  double occupied_beyond = 0;    // share of them that are farther than 15 cm
  double deepest_free = 0;       // depth of free voxel centres inside solids, largest, m
  double seen_and_occupied = 0;  // share of the seen surface with an occupied voxel within 15 cm
  std::size_t occupied = 0, free = 0;
};

/// Compares a map with the scene, by the scene's closed form alone.
Quality compare(const OccupancyMap& map, const AnalyticFlight& flight) {
  Quality quality;
  std::size_t beyond = 0;
  map.for_each([&](const MapCell& cell, Occupancy state) {
    const int n = 1 << (16 - static_cast<int>(cell.depth));
    const double voxel = map.options().voxel;
    for (int i = 0; i < n * n * n; ++i) {
      const Vector3d offset(i % n, i / n % n, i / (n * n));  // NOLINT(bugprone-integer-division)
      const Vector3d centre =
          cell.centre.cast<double>() + voxel * (offset - Vector3d::Constant(0.5 * (n - 1)));
      const double distance = flight.scene.signed_distance(centre);
      if (state == Occupancy::occupied) {
        ++quality.occupied;
        quality.farthest_occupied = std::max(quality.farthest_occupied, std::abs(distance));
        beyond += std::abs(distance) > 0.15 ? 1 : 0;
      } else {
        ++quality.free;
        quality.deepest_free = std::max(quality.deepest_free, -distance);
      }
    }
  });
  quality.occupied_beyond =
      static_cast<double>(beyond) / static_cast<double>(std::max<std::size_t>(quality.occupied, 1));

  std::size_t seen = 0;
  std::size_t covered = 0;
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    DepthImage exact = depth_image(flight, k);
    for (const CloudPoint& point : back_project(exact, flight.camera, flight.T_world_camera[k], {}, 3)) {
      const Vector3d p(point.x, point.y, point.z);
      const double z = (flight.T_world_camera[k].inverse() * p).z();
      if (z > map.options().range) continue;
      ++seen;
      bool near = false;
      const double voxel = map.options().voxel;
      for (int i = 0; i < 27 && !near; ++i) {
        const Vector3d q =
            p + voxel * Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);  // NOLINT(bugprone-integer-division)
        const Vector3d centre = ((q / voxel).array().floor() + 0.5) * voxel;
        near = (centre - p).norm() <= 0.15 && map.at(q) == Occupancy::occupied;
      }
      covered += near ? 1 : 0;
    }
  }
  quality.seen_and_occupied = static_cast<double>(covered) / static_cast<double>(seen);
  return quality;
}

void report(const Quality& quality) {
  const auto record = [](const char* name, double value) {
    testing::Test::RecordProperty(name, std::to_string(value));
  };
  record("farthest_occupied_m", quality.farthest_occupied);
  record("occupied_beyond_15cm", quality.occupied_beyond);
  record("deepest_free_m", quality.deepest_free);
  record("seen_and_occupied", quality.seen_and_occupied);
  record("occupied_voxels", static_cast<double>(quality.occupied));
  record("free_voxels", static_cast<double>(quality.free));
}

class MapOfAScene : public testing::TestWithParam<std::string> {};

TEST_P(MapOfAScene, LiesOnItsSurfacesAndCoversThemWithExactDepth) {
  const AnalyticFlight flight = *make_analytic_flight(GetParam(), 6);
  const Quality quality = compare(map_of(flight, 0, {}), flight);
  report(quality);
  EXPECT_LE(quality.farthest_occupied, 0.15);
  EXPECT_GE(quality.seen_and_occupied, 0.95);
  EXPECT_LE(quality.deepest_free, 0.15);
  EXPECT_GT(quality.free, 100 * quality.occupied / 10);
}

TEST_P(MapOfAScene, LiesOnItsSurfacesAndCoversThemWithNoisyDepthOfKnownSigma) {
  const AnalyticFlight flight = *make_analytic_flight(GetParam(), 10);
  MapOptions options;
  options.range = 8;
  const Quality quality = compare(map_of(flight, 0.01, options), flight);
  report(quality);
  EXPECT_LE(quality.occupied_beyond, 0.001);
  EXPECT_GE(quality.seen_and_occupied, 0.95);
  EXPECT_LE(quality.deepest_free, 0.15);
}

INSTANTIATE_TEST_SUITE_P(Flights, MapOfAScene, testing::Values("forward", "sideways", "turning", "courtyard"),
                         [](const auto& flight) { return flight.param; });

}  // namespace
}  // namespace pade::mapping
