#include "pade/mapping/query/map_view.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "pade/mapping/tiles/voxel_code.hpp"

#include "mapping/flown_map.hpp"
#include "mapping/query/random_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

Vector3d random_in(const AlignedBox3d& box, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Vector3d share(unit(random), unit(random), unit(random));
  return box.min() + share.cwiseProduct(box.sizes());
}

void expect_same(const MapView& view, const OccupancyMap& map, const Vector3d& point) {
  EXPECT_EQ(view.at(point), map.at(point)) << point.transpose();
  const double theirs = map.probability(point);
  if (std::isnan(theirs)) {
    EXPECT_TRUE(std::isnan(view.probability(point)));
  } else {
    EXPECT_NEAR(view.probability(point), theirs, 0.005);
  }
}

TEST(MapView, SaysOfEachPointWhatTheOctreeSays) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const OccupancyMap map = random_map(seed);
    const auto view = MapView::of(map);
    std::mt19937_64 random(seed);
    const AlignedBox3d around(Vector3d::Constant(-5), Vector3d::Constant(5));
    for (int i = 0; i < 20000; ++i) expect_same(*view, map, random_in(around, random));
    for (const double far : {3276.0, 3277.0, 1e9, std::nan(""), std::numeric_limits<double>::infinity()})
      expect_same(*view, map, {far, 0, 0});
  }
}

TEST(MapView, SaysItOfLargeMapsAndAtTheBorderToo) {
  const double border = 3276.8;
  // Places that are known: near each other, too far apart for an index of tiles, for one of groups, and at
  // the border of what can be addressed, where a place below it is rounded to the first voxel.
  const std::vector<std::vector<Vector3d>> maps{
      {{0, 0, 0}, {7, 3, 1}},
      {{0, 0, 0}, {200, 200, 200}},
      {{-300, -300, -300}, {300, 300, 300}},
      {Vector3d::Constant(0.05 - border), {0.05 - border, 1 - border, 2 - border}},
      {Vector3d::Constant(border - 0.05), {border - 1, border - 0.05, 0}}};
  std::mt19937_64 random(5);
  for (const auto& places : maps) {
    auto tree = std::make_unique<octomap::OcTree>(0.1);
    for (const Vector3d& place : places)
      for (int i = 0; i < 400; ++i) {
        const Vector3d at = random_in({place.array() - 0.8, place.array() + 0.8}, random);
        tree->setNodeValue(at.x(), at.y(), at.z(), i % 3 == 0 ? 2.0F : -1.0F);
      }
    tree->updateInnerOccupancy();
    const OccupancyMap map = std::move(OccupancyMap::create({}, std::move(tree))).value();
    const auto view = MapView::of(map);
    int known = 0;
    for (const Vector3d& place : places)
      for (int i = 0; i < 2000; ++i) {
        Vector3d at = random_in({place.array() - 1, place.array() + 1}, random);
        if (i % 4 == 0) at = (10 * at).array().round() / 10;  // corners of voxels
        expect_same(*view, map, at);
        known += view->at(at) == Occupancy::unknown ? 0 : 1;
        at[i % 3] = i % 2 == 0 ? std::nan("") : -1e300;
        EXPECT_EQ(view->at(at), Occupancy::unknown);
      }
    EXPECT_GT(known, 20);
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d below = places[0];
      below[axis] = -border - 0.05;
      EXPECT_EQ(view->at(below), Occupancy::unknown);
    }
  }
}

TEST(MapView, AfterEachFrameIsWhatItWouldBeMadeAnewAndTheOldOneStays) {
  const simulation::AnalyticFlight flight =
      *simulation::make_analytic_flight("courtyard", 5, simulation::analytic_camera(96, 72));
  OccupancyMap map = std::move(OccupancyMap::create()).value();
  auto view = MapView::of(map);
  std::vector<std::pair<std::shared_ptr<const MapView>, std::vector<Occupancy>>> kept;
  std::mt19937_64 random(1);
  std::vector<Vector3d> points;
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    const DepthImage image = depth_image(flight, k, 0.01);
    view = view->after(map, map.integrate(image, flight.camera, flight.T_world_camera[k]));
    if (points.empty()) {
      for (int i = 0; i < 5000; ++i) points.push_back(random_in(map.bounds(), random));
    }
    std::vector<Occupancy> states;
    for (const Vector3d& point : points) {
      expect_same(*view, map, point);
      states.push_back(view->at(point));
    }
    kept.emplace_back(view, std::move(states));
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_NE(kept.front().second, kept.back().second);
  for (const auto& [old, states] : kept) {
    for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(old->at(points[i]), states[i]);
  }
}

/// A threshold at or below the probability of a miss makes obstacles of all that is seen free: odd, but map
/// and view must not say different things of one voxel.
TEST(MapView, AgreesWithItsMapWhateverTheThreshold) {
  const auto flight = simulation::make_analytic_flight("forward", 4, simulation::analytic_camera(96, 72));
  for (const double threshold : {0.2, 0.35, 0.5, 0.65, 0.9}) {
    MapOptions options;
    options.occupancy_threshold = threshold;
    OccupancyMap map = std::move(OccupancyMap::create(options)).value();
    auto view = MapView::of(map);
    for (std::size_t k = 0; k < flight->times.size(); ++k)
      view = view->after(
          map, map.integrate(depth_image(*flight, k, 0.02), flight->camera, flight->T_world_camera[k]));
    std::size_t cells = 0;
    map.for_each([&](const MapCell& cell, Occupancy state) {
      const Vector3d inside = cell.centre.cast<double>().array() + 0.01;
      ASSERT_EQ(view->at(inside), state) << threshold << ": " << inside.transpose();
      ASSERT_EQ(map.at(inside), state) << threshold << ": " << inside.transpose();
      ++cells;
    });
    EXPECT_GT(cells, 500U) << threshold;
  }
}

/// What is saved of a view says of each place what the view says, in few cubes where much is the same.
TEST(MapView, ItsLeavesAreTheMapInAsFewCubes) {
  const OccupancyMap map = random_map(7);
  const auto view = MapView::of(map);
  std::size_t ours = 0, theirs = 0;
  std::uint64_t end = 0;
  view->for_each_leaf([&](const MapLeaf& leaf) {
    ASSERT_GE(leaf.code, end) << "in order, disjoint";
    end = leaf.code + voxels_of(leaf.depth);
    ++ours;
    for (const std::uint64_t code : {leaf.code, end - 1}) {
      const Vector3d place = centre_of(morton_key(code), map.options().voxel);
      ASSERT_EQ(map.at(place), leaf.is_occupied ? Occupancy::occupied : Occupancy::free);
    }
  });
  map.for_each_leaf([&](const MapLeaf&) { ++theirs; });
  EXPECT_LE(ours, theirs);
  const OccupancyMap::Counts counts = map.counts();
  std::size_t voxels = 0;
  view->for_each_leaf([&](const MapLeaf& leaf) { voxels += voxels_of(leaf.depth); });
  EXPECT_EQ(voxels, counts.occupied + counts.free);
}

TEST(MapView, KnowsNothingOutsideItsWindow) {
  const OccupancyMap map = random_map(5);
  const AlignedBox3d window(Vector3d(-2, -1, -1), Vector3d(1, 2, 1));
  const auto view = MapView::of(map, window);
  std::mt19937_64 random(5);
  const AlignedBox3d around(Vector3d::Constant(-5), Vector3d::Constant(5));
  const double tile = 8 * view->voxel();
  std::size_t inside = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vector3d point = random_in(around, random);
    const double beyond = std::sqrt(window.squaredExteriorDistance(point));
    if (beyond == 0) {
      expect_same(*view, map, point);
      ++inside;
    } else if (beyond > std::sqrt(3) * tile) {
      EXPECT_EQ(view->at(point), Occupancy::unknown);
    }
  }
  EXPECT_GT(inside, 100U);
}

TEST(MapView, TakesTheMemoryOfWhatIsKnownInItsWindow) {
  const OccupancyMap map = random_map(5);
  const auto nothing = MapView::of(std::move(OccupancyMap::create()).value());
  const auto part = MapView::of(map, {Vector3d::Constant(-1), Vector3d::Constant(1)});
  const auto all = MapView::of(map);
  EXPECT_LT(nothing->memory(), 200'000U);
  EXPECT_GT(part->memory(), nothing->memory());
  EXPECT_GT(all->memory(), part->memory());
  // What differs has at least the words of a tile, and no more than those and a byte for each voxel.
  std::set<std::array<long, 3>> tiles;
  map.for_each([&](const MapCell& cell, Occupancy) {
    tiles.insert({cell.key[0] / 8, cell.key[1] / 8, cell.key[2] / 8});
  });
  EXPECT_LT(all->memory(), nothing->memory() + 1000 * tiles.size() + 300'000);
}

TEST(MapView, CountsTheVoxelsOfABoxAndOfABall) {
  const OccupancyMap map = random_map(6);
  const auto view = MapView::of(map);
  const double voxel = view->voxel();
  std::mt19937_64 random(6);
  const AlignedBox3d around(Vector3d::Constant(-5), Vector3d::Constant(5));
  for (int i = 0; i < 50; ++i) {
    const Vector3d centre = random_in(around, random);
    const double radius = 0.05 + 0.1 * (i % 8);
    const AlignedBox3d box(centre.array() - radius, centre.array() + 0.5 * radius);
    Contents in_box{};
    Contents in_ball{};
    double highest = -1;
    const Vector3d first = ((centre.array() - 1.2) / voxel).floor() + 0.5;
    for (int k = 0; k < 24 * 24 * 24; ++k) {
      const Vector3d at = voxel * (first + Vector3d(k % 24, k / 24 % 24, k / 576));  // NOLINT
      const AlignedBox3d cube(at.array() - voxel / 2, at.array() + voxel / 2);
      const Occupancy state = map.at(at);
      const auto add = [&](Contents& to) {
        ++(state == Occupancy::occupied ? to.occupied : state == Occupancy::free ? to.free : to.unknown);
      };
      if (cube.intersects(box)) add(in_box);
      if (std::sqrt(cube.squaredExteriorDistance(centre)) >= radius) continue;
      add(in_ball);
      if (state != Occupancy::unknown) highest = std::max(highest, map.probability(at));
    }
    const Contents box_found = view->in_box(box);
    EXPECT_EQ(box_found.occupied, in_box.occupied);
    EXPECT_EQ(box_found.free, in_box.free);
    EXPECT_EQ(box_found.unknown, in_box.unknown);
    const Contents ball_found = view->in_ball(centre, radius);
    EXPECT_EQ(ball_found.occupied, in_ball.occupied);
    EXPECT_EQ(ball_found.free, in_ball.free);
    EXPECT_EQ(ball_found.unknown, in_ball.unknown);
    if (highest < 0) {
      EXPECT_TRUE(std::isnan(ball_found.probability));
    } else {
      EXPECT_NEAR(ball_found.probability, highest, 0.005);
    }
  }
}

TEST(MapView, TakesWhereTheVehicleWasForFreeButNoObstacle) {
  const OccupancyMap map = random_map(7);
  const auto view = MapView::of(map);
  const std::vector<Vector3d> track{{-4, -1, 0}, {0, 1, 1}, {4, 2, -1}, {30, 2, -1}};
  const auto flown = view->flown(track, 0.4);
  EXPECT_TRUE(view->sweep(track, 0.4, UnknownSpace::blocked));
  const auto hit = flown->sweep(track, 0.4, UnknownSpace::blocked);
  const auto obstacle = view->sweep(track, 0.4, UnknownSpace::free);
  ASSERT_EQ(hit.has_value(), obstacle.has_value());
  if (hit) {
    EXPECT_DOUBLE_EQ(hit->length, obstacle->length);
  }
  std::mt19937_64 random(7);
  const AlignedBox3d around(Vector3d::Constant(-5), Vector3d::Constant(5));
  for (int i = 0; i < 20000; ++i) {
    const Vector3d point = random_in(around, random);
    if (flown->at(point) != view->at(point)) {
      EXPECT_EQ(view->at(point), Occupancy::unknown);
      EXPECT_EQ(flown->at(point), Occupancy::free);
      EXPECT_LT(flown->probability(point), 0.5);
    }
  }
}

// For the thread sanitizer: the mapper goes on while a planner asks the views that it has put out.
TEST(MapView, IsAskedByAPlannerWhileTheMapperGoesOn) {
  const simulation::AnalyticFlight flight =
      *simulation::make_analytic_flight("forward", 6, simulation::analytic_camera(64, 48));
  OccupancyMap map = std::move(OccupancyMap::create()).value();
  std::mutex mutex;
  auto latest = MapView::of(map);
  std::atomic<bool> done = false;
  std::size_t asked = 0;
  std::thread planner([&] {
    do {
      std::shared_ptr<const MapView> view;
      {
        const std::lock_guard lock(mutex);
        view = latest;
      }
      const std::vector<Vector3d> path{flight.T_world_camera[0].translation,
                                       flight.T_world_camera[5].translation};
      const auto hit = view->flown(path, 0.3)->sweep(path, 0.3, UnknownSpace::blocked);
      asked += hit ? 1 : 2;
    } while (!done);
  });
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    auto next =
        latest->after(map, map.integrate(depth_image(flight, k), flight.camera, flight.T_world_camera[k]));
    const std::lock_guard lock(mutex);
    latest = std::move(next);
  }
  done = true;
  planner.join();
  EXPECT_GT(asked, 0U);
  EXPECT_NE(latest->in_box(map.bounds()).free, 0U);
}

}  // namespace
}  // namespace pade::mapping
