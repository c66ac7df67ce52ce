// What bounds, the two parts of sigma and the number of looks mean for the map.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "pade/mapping/occupancy_map.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const Camera kCamera = simulation::analytic_camera(160, 120);
const Camera kLarge = simulation::analytic_camera(480, 360);

/// A camera at (x, y, 1.53) that looks along the world's x, its optical axis inside of voxels.
Pose level_at(double x, double y = 0.03) {
  static const Pose level = simulation::make_analytic_flight("forward", 1)->T_world_camera[0];
  Pose pose = level;
  pose.translation = Vector3d(x, y, 1.53);
  return pose;
}

OccupancyMap map_of_looks(const MapOptions& options = {}) {
  return std::move(OccupancyMap::create(options)).value();
}

DepthImage nothing_known(const Camera& camera = kCamera) {
  DepthImage image;
  image.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(kNaN));
  image.variance = image.depth.clone();
  image.own_variance = image.depth.clone();
  image.bound = image.depth.clone();
  image.state = cv::Mat(image.depth.size(), CV_8UC1, cv::Scalar(static_cast<int>(DepthState::no_texture)));
  return image;
}

DepthImage bounded_to(double bound) {
  DepthImage image = nothing_known();
  image.bound.setTo(bound);
  image.state.setTo(static_cast<int>(DepthState::low_parallax));
  return image;
}

/// A wall across the optical axis, its depth with normal noise of standard deviation `own`, and `common` more
/// that the variance states.
DepthImage wall(double z, double own, double common, std::uint64_t seed = 1, const Camera& camera = kCamera) {
  DepthImage image = nothing_known(camera);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (float& depth : cv::Mat_<float>(image.depth)) depth = static_cast<float>(z + own * normal(random));
  image.own_variance.setTo(own * own);
  image.variance.setTo(own * own + common * common);
  image.bound.setTo(std::max(0.0, z - 2.5 * std::hypot(own, common)));
  image.state.setTo(0);
  return image;
}

std::size_t occupied(const OccupancyMap& map) { return map.counts().occupied; }

TEST(TwoLooks, BoundsAloneClearACorridorAfterTwoPlacesAndNotAfterOne) {
  const DepthImage image = bounded_to(10);
  OccupancyMap map = map_of_looks();
  const MapChange first = map.integrate(image, kCamera, level_at(0));
  EXPECT_GT(first.pending_free, 10000U);
  for (int i = 0; i < 5; ++i) {
    const MapChange again = map.integrate(image, kCamera, level_at(0.01 * i));
    EXPECT_GT(again.pending_free, 10000U);
  }
  EXPECT_EQ(map.counts().free, 0U);
  map.integrate(image, kCamera, level_at(0.1));
  EXPECT_EQ(occupied(map), 0U);
  for (double x = 1; x < 9.86; x += 0.1) EXPECT_EQ(map.at({x, 0.03, 1.53}), Occupancy::free) << x;
  for (double x = 10.15; x < 20; x += 0.1) EXPECT_EQ(map.at({x, 0.03, 1.53}), Occupancy::unknown) << x;
}

TEST(TwoLooks, TheTwoNeedNotBeNeighboursInTime) {
  OccupancyMap map = map_of_looks();
  map.integrate(bounded_to(10), kCamera, level_at(0));
  map.integrate(nothing_known(), kCamera, level_at(0.2));
  EXPECT_EQ(map.counts().free, 0U);
  map.integrate(bounded_to(10), kCamera, level_at(0.4));
  EXPECT_EQ(map.at({5, 0.03, 1.53}), Occupancy::free);
}

TEST(TwoLooks, OneOfAnotherPlaceThatSawAnObstacleConfirmsNothing) {
  OccupancyMap map = map_of_looks();
  map.integrate(bounded_to(4), kCamera, level_at(0));
  const MapChange change = map.integrate(bounded_to(10), kCamera, level_at(0.2));
  EXPECT_EQ(map.at({3, 0.03, 1.53}), Occupancy::free);
  EXPECT_EQ(map.at({6, 0.03, 1.53}), Occupancy::unknown);
  EXPECT_GT(change.pending_free, 1000U);
}

TEST(Bounds, AThinPoleIsNeverClearedThrough) {
  // A vertical line at (6, 0.08), 2 pixels wide, with a near bound or none, before a wall far behind it; one
  // pixel in 50 of the rest knows nothing.
  for (const bool is_known : {true, false}) {
    OccupancyMap map = map_of_looks();
    std::mt19937_64 random(5);
    for (int k = 0; k < 12; ++k) {
      const Pose pose = level_at(0.4 * k, 0.03 + 0.04 * k);
      DepthImage image = bounded_to(15);
      for (float& bound : cv::Mat_<float>(image.bound)) {
        if (random() % 200 == 0) bound = kNaN;
      }
      const Vector3d pole = pose.inverse() * Vector3d(6, 0.08, 1.53);
      const auto column = static_cast<int>(kCamera.project(pole)->x());
      image.bound.colRange(column, column + 2).setTo(is_known ? 0.97 * pole.z() : kNaN);
      map.integrate(image, kCamera, pose);
      for (double z = 0.5; z < 2.5; z += 0.02)
        ASSERT_NE(map.at({6, 0.08, z}), Occupancy::free) << k << " " << z;
    }
    EXPECT_EQ(map.at({5.5, 0.45, 1.53}), Occupancy::free);
    EXPECT_EQ(map.at({6.0, 0.75, 1.53}), Occupancy::free);
  }
}

TEST(Bounds, ASpotHidesWhatIsBehindItOnlyWhereMoreThanFreeHoleFits) {
  // A spot of n pixels that knows nothing, or sees to 1 m only, leaves everything unknown behind free_hole f
  // / n.
  const double f = kCamera.fx;
  for (const int n : {1, 2, 3, 4, 7}) {
    for (const float sight : {kNaN, 1.0F}) {
      MapOptions options;
      options.looks_baseline = 0;
      OccupancyMap map = map_of_looks(options);
      DepthImage image = bounded_to(18);
      image.bound(cv::Rect(80, 60, n, n)).setTo(sight);
      map.integrate(image, kCamera, level_at(0));
      const double end = std::min(options.free_hole * f / n, 18.0);
      const double surely = std::max(std::isnan(sight) ? 0.0 : 1.0, end / 1.3);  // sizes are tried by steps
      const Vector3d ray = level_at(0).rotation * Vector3d((80 + 0.5 * (n - 1) - kCamera.cx) / f,
                                                           (60 + 0.5 * (n - 1) - kCamera.cy) / f, 1);
      for (double z = 0.5; z < 17.9; z += 0.05) {
        const Occupancy state = map.at(level_at(0).translation + z * ray);
        if (z < surely - 0.2) {
          EXPECT_EQ(state, Occupancy::free) << n << " at " << z;
        }
        if (z > std::max(end, 1.0) + 0.2) {
          EXPECT_EQ(state, Occupancy::unknown) << n << " at " << z;
        }
      }
    }
  }
}

TEST(Bounds, ASpotMayBeWiderThanTheImageIsHigh) {
  MapOptions options;
  options.looks_baseline = 0;
  options.free_hole = 1;
  constexpr int kWide = 140;
  static_assert(kWide > 120);
  OccupancyMap map = map_of_looks(options);
  DepthImage image = bounded_to(18);
  image.bound(cv::Rect(10, 60, kWide, 2)).setTo(kNaN);
  map.integrate(image, kCamera, level_at(0));
  const double end = options.free_hole * kCamera.fx / kWide;
  const Vector3d ray =
      level_at(0).rotation * Vector3d((80 - kCamera.cx) / kCamera.fx, (60.5 - kCamera.cy) / kCamera.fy, 1);
  for (double z = 0.5; z < end / 1.3 - 0.1; z += 0.02)
    EXPECT_EQ(map.at(level_at(0).translation + z * ray), Occupancy::free) << z;
  EXPECT_EQ(map.at(level_at(0).translation + (end + 0.3) * ray), Occupancy::unknown);
}

TEST(Bounds, EachLookMakesSurerWhatItSeesAndNothingBesideItDownToTheLimit) {
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = map_of_looks(options);
  map.integrate(bounded_to(15), kCamera, level_at(0));  // large cubes of one state
  DepthImage narrow = bounded_to(15);
  for (const cv::Range& side : {cv::Range(0, 60), cv::Range(100, 160)})
    narrow.bound.colRange(side).setTo(kNaN);
  const double miss = options.p_miss / (1 - options.p_miss);
  const double least = options.clamp_min / (1 - options.clamp_min);
  for (int looks = 1; looks < 8; ++looks) {
    const double odds = std::max(std::pow(miss, looks), least);
    for (double x = 4; x < 12; x += 0.1) {
      EXPECT_NEAR(map.probability({x, 0.03, 1.53}), odds / (1 + odds), 1e-4) << looks << " looks at " << x;
      EXPECT_NEAR(map.probability({x, 0.03 + 0.35 * x, 1.53}), options.p_miss, 1e-4) << x;
    }
    map.integrate(narrow, kCamera, level_at(0));
  }
}

TEST(Bounds, ASpotThatHasMeasuredSomethingIsNotClosed) {
  MapOptions options;
  options.looks_baseline = 0;
  for (const bool is_measured : {true, false}) {
    OccupancyMap map = map_of_looks(options);
    DepthImage image = bounded_to(15);
    image.bound.at<float>(60, 80) = 2;
    if (is_measured) {
      image.depth.at<float>(60, 80) = 2.2F;
      image.state.at<std::uint8_t>(60, 80) = static_cast<std::uint8_t>(DepthState::measured);
      image.variance.at<float>(60, 80) = image.own_variance.at<float>(60, 80) = 1e-4F;
    }
    map.integrate(image, kCamera, level_at(0));
    const Vector3d ray =
        level_at(0).rotation * Vector3d((80 - kCamera.cx) / kCamera.fx, (60 - kCamera.cy) / kCamera.fy, 1);
    EXPECT_EQ(map.at(level_at(0).translation + 3.0 * ray),
              is_measured ? Occupancy::unknown : Occupancy::free);
  }
}

TEST(Bounds, TheBlindSpotAboutTheEpipoleIsClosedAsFarAsItHidesNothing) {
  // Bounds as parallax of 1 px per metre of motion gives them 0.8 m before a wall at 15 m.
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = map_of_looks(options);
  DepthImage image = bounded_to(15);
  for (int v = 0; v < image.bound.rows; ++v) {
    for (int u = 0; u < image.bound.cols; ++u) {
      const double reach = 0.8 * std::hypot(u - 80, v - 60);
      image.bound.at<float>(v, u) = static_cast<float>(reach / (reach / 15.8 + 0.5));
    }
  }
  map.integrate(image, kCamera, level_at(0));
  const Vector3d ray =
      level_at(0).rotation * Vector3d((80 - kCamera.cx) / kCamera.fx, (60 - kCamera.cy) / kCamera.fy, 1);
  double free_to = 0.6;
  while (map.at(level_at(0).translation + (free_to + 0.05) * ray) == Occupancy::free) free_to += 0.05;
  EXPECT_GT(free_to, 1.5);
  int spot = 0;  // pixels of the row that see less far
  for (int u = 0; u < image.bound.cols; ++u) spot += image.bound.at<float>(60, u) < free_to - 0.1 ? 1 : 0;
  EXPECT_LE(spot * free_to / kCamera.fx, options.free_hole + 0.02);
}

TEST(Bounds, AHoleIsFilledNoFartherThanTheNearestBoundAroundIt) {
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = map_of_looks(options);
  DepthImage image = bounded_to(15);
  image.bound(cv::Rect(50, 30, 20, 60)).setTo(6);  // a thing with a hole at its edge
  image.bound.at<float>(60, 70) = kNaN;
  map.integrate(image, kCamera, level_at(0));
  const Vector3d ray = level_at(0).rotation * Vector3d((70 - kCamera.cx) / kCamera.fx, 0.5 / kCamera.fx, 1);
  EXPECT_EQ(map.at(level_at(0).translation + 4.3 * ray), Occupancy::free);
  EXPECT_EQ(map.at(level_at(0).translation + 6.3 * ray), Occupancy::unknown);
}

TEST(Bounds, AHoleAtTheBorderMayGoOnBeyondIt) {
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = map_of_looks(options);
  DepthImage image = bounded_to(15);
  image.bound.at<float>(60, 0) = kNaN;
  map.integrate(image, kCamera, level_at(0));
  const Vector3d ray = level_at(0).rotation * Vector3d(-kCamera.cx / kCamera.fx, 0.5 / kCamera.fx, 1);
  for (double z = 0.5; z < 15; z += 0.1)
    EXPECT_EQ(map.at(level_at(0).translation + z * ray), Occupancy::unknown) << z;
}

TEST(Bounds, AVoxelThatIsHitIsNotClearedByTheSameImage) {
  // Bounds that contradict the depth.
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = map_of_looks(options);
  DepthImage image = wall(5.04, 0, 0);
  image.bound.setTo(12);
  map.integrate(image, kCamera, level_at(0));
  EXPECT_EQ(map.at({5.04, 0.03, 1.53}), Occupancy::occupied);
  EXPECT_EQ(map.at({4.5, 0.03, 1.53}), Occupancy::free);
  EXPECT_EQ(map.at({5.2, 0.03, 1.53}), Occupancy::unknown);
}

TEST(Bounds, OneThatContradictsAnObstacleDoesNotClearIt) {
  OccupancyMap map = map_of_looks();
  map.integrate(bounded_to(12), kCamera, level_at(0));
  map.integrate(wall(5.04, 0, 0), kCamera, level_at(0.2));
  const Vector3d point(5.24, 0.03, 1.53);
  ASSERT_EQ(map.at(point), Occupancy::occupied);
  map.integrate(bounded_to(12), kCamera, level_at(0.4));
  EXPECT_EQ(map.at(point), Occupancy::occupied);
  for (int k = 3; k < 8; ++k) map.integrate(bounded_to(12), kCamera, level_at(0.2 * k));
  EXPECT_EQ(map.at(point), Occupancy::free);
}

TEST(Hits, ANearGoodOneIsAnObstacleAtOnceAndAFarOneWaitsForAnotherPlace) {
  OccupancyMap near = map_of_looks();
  near.integrate(wall(5.04, 0.02, 0), kCamera, level_at(0));
  EXPECT_GT(occupied(near), 500U);

  OccupancyMap far = map_of_looks();
  for (int i = 0; i < 4; ++i) {
    const MapChange change = far.integrate(wall(12.04, 0.02, 0), kCamera, level_at(0));
    EXPECT_EQ(occupied(far), 0U);
    EXPECT_GT(change.pending_hits, 2000U);
  }
  far.integrate(wall(11.94, 0.02, 0), kCamera, level_at(0.1));
  EXPECT_GT(occupied(far), 2000U);
}

TEST(Hits, TheTailsOfTheNoiseBehindASurfaceAreNone) {
  // One pixel in 14 says that the wall is two voxels farther: with nothing between, and its share of the
  // voxel's pixels large enough for a thing of its own.
  OccupancyMap map = map_of_looks();
  DepthImage image = wall(5.05, 0.001, 0, 1, kLarge);
  for (int v = 0; v < image.depth.rows; ++v) {
    for (int u = 0; u < image.depth.cols; ++u) {
      if ((u + 5 * v) % 14 == 0) image.depth.at<float>(v, u) = 5.25F;
    }
  }
  map.integrate(image, kLarge, level_at(0));
  std::size_t at_wall = 0;
  std::size_t behind = 0;
  for (const MapCell& cell : map.occupied()) ++(cell.centre.x() < 5.15F ? at_wall : behind);
  EXPECT_GT(at_wall, 500U);
  EXPECT_LT(behind, at_wall / 20);
}

TEST(Hits, ASigmaThatIsCommonToTheImageMovesTheSurfaceAndDoesNotRemoveIt) {
  OccupancyMap map = map_of_looks();
  for (int k = 0; k < 4; ++k)
    map.integrate(wall(10.04 - 0.2 * k, 0.02, 0.5, 1, kLarge), kLarge, level_at(0.2 * k));
  EXPECT_EQ(map.at({10.04, 0.03, 1.53}), Occupancy::occupied);
  EXPECT_GT(occupied(map), 4000U);
}

TEST(Hits, UncertainOnesAddUpToASurfaceWhereItIs) {
  for (const std::uint64_t seed : {1U, 2U}) {
    OccupancyMap map = map_of_looks();
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    map.integrate(wall(6.04, 0.3, 0, seed, kLarge), kLarge, level_at(0));
    EXPECT_EQ(occupied(map), 0U);
    for (std::uint64_t k = 1; k < 9; ++k) {
      const double x = 0.2 * static_cast<double>(k);
      map.integrate(wall(6.04 - x, 0.3, 0, 100 * seed + k, kLarge), kLarge, level_at(x));
    }
    std::size_t near = 0;
    for (const MapCell& cell : map.occupied()) near += std::abs(cell.centre.x() - 6.04) < 0.3 ? 1 : 0;
    EXPECT_GT(near, 800U);
    EXPECT_GT(static_cast<double>(near), 0.92 * static_cast<double>(occupied(map)));
  }
}

TEST(Hits, ADepthThatIsLessCertainThanTheRelativeLimitIsCountedAndPlacesNothing) {
  OccupancyMap map = map_of_looks();
  for (int k = 0; k < 5; ++k) {
    const MapChange change = map.integrate(wall(5, 0.1, 1.5), kCamera, level_at(0.2 * k));
    EXPECT_EQ(change.too_uncertain, static_cast<std::size_t>(kCamera.width) * kCamera.height);
    EXPECT_EQ(change.pending_hits, 0U);
  }
  EXPECT_EQ(occupied(map), 0U);
}

TEST(Hits, ThoseThatWaitAreForgottenBehindTheVehicle) {
  // Walls that are never at the same place again, over 30 m.
  OccupancyMap map = map_of_looks();
  std::size_t most_early = 0;
  std::size_t most_late = 0;
  for (int k = 0; k < 60; ++k) {
    const DepthImage image = wall(9 + 1.3 * (k % 7), 0.02, 0);
    const std::size_t waiting = map.integrate(image, kCamera, level_at(0.5 * k)).pending_hits;
    auto& most = k < 40 ? most_early : most_late;
    most = std::max(most, waiting);
  }
  EXPECT_GT(most_early, 10000U);
  EXPECT_LE(most_late, most_early * 11 / 10);
}

}  // namespace
}  // namespace pade::mapping
