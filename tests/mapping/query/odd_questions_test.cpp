// Numbers that are none, and places that no map holds: each question has an answer, and it is never that the
// way is clear.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/surroundings.hpp"

#include "mapping/flown_map.hpp"
#include "mapping/query/random_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr std::array kBoth{UnknownSpace::blocked, UnknownSpace::free};

/// A point with each of its coordinates replaced, one at a time.
std::vector<Vector3d> spoiled(const Vector3d& point) {
  std::vector<Vector3d> all;
  for (int axis = 0; axis < 3; ++axis)
    for (const double value : {kNone, kEndless, -kEndless}) {
      all.push_back(point);
      all.back()[axis] = value;
    }
  return all;
}

void expect_nothing_in(const Contents& contents) {
  EXPECT_EQ(contents.occupied + contents.free, 0U);
  EXPECT_TRUE(std::isnan(contents.probability));
}

void expect_blocked_at_once(const std::optional<Hit>& hit) {
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->length, 0);
  EXPECT_EQ(hit->state, Occupancy::unknown);
}

void expect_all_blocked(const std::array<double, kSectors>& distances) {
  for (const double distance : distances) EXPECT_EQ(distance, 0);
}

void expect_same_contents(const Contents& a, const Contents& b) {
  EXPECT_EQ(a.occupied, b.occupied);
  EXPECT_EQ(a.free, b.free);
}

class OddQuestions : public testing::Test {
 protected:
  OccupancyMap map_ = random_map(21);
  std::shared_ptr<const MapView> view_ = MapView::of(map_);
  Vector3d place_{0.33, -0.21, 0.14};
};

TEST_F(OddQuestions, AboutNoPlace) {
  const Contents all = view_->in_box(view_->bounds());
  for (const Vector3d& odd : spoiled(place_)) {
    SCOPED_TRACE(testing::Message() << odd.transpose());
    EXPECT_EQ(map_.at(odd), Occupancy::unknown);
    EXPECT_TRUE(std::isnan(map_.probability(odd)));
    EXPECT_EQ(view_->at(odd), Occupancy::unknown);
    EXPECT_TRUE(std::isnan(view_->probability(odd)));
    expect_nothing_in(view_->in_ball(odd, 0.5));
    expect_same_contents(view_->flown(std::vector<Vector3d>{odd}, 0.5)->in_box(view_->bounds()), all);
    expect_same_contents(view_->flown(std::vector<Vector3d>{place_, odd}, 0.5)->in_box(view_->bounds()), all);
    for (const UnknownSpace unknown : kBoth) {
      expect_blocked_at_once(view_->ray(odd, {1, 0, 0}, 5, unknown));
      expect_blocked_at_once(view_->ray(place_, odd, 5, unknown));
      expect_blocked_at_once(view_->sweep(std::vector<Vector3d>{odd}, 0.3, unknown));
      expect_blocked_at_once(view_->sweep(std::vector<Vector3d>{odd, place_}, 0.3, unknown));
      expect_blocked_at_once(view_->sweep(std::vector<Vector3d>{place_, odd}, 0.3, unknown));
      expect_all_blocked(sectors(*view_, odd, 3, 0.5, 0.5, unknown));
      const DistanceField field = DistanceField::of(*view_, {odd, odd}, unknown);
      EXPECT_EQ(field.size().maxCoeff(), 0);
      EXPECT_TRUE(std::isnan(field.distance(place_)));
    }
    const DistanceField field =
        DistanceField::of(*view_, {place_.array() - 0.5, place_.array() + 0.5}, UnknownSpace::free);
    EXPECT_TRUE(std::isnan(field.distance(odd)));
    EXPECT_TRUE(field.gradient(odd).hasNaN());
    if (!odd.hasNaN()) continue;
    for (const AlignedBox3d& box : {AlignedBox3d(odd, Vector3d::Constant(9)), AlignedBox3d(place_, odd)}) {
      expect_nothing_in(view_->in_box(box));
      EXPECT_TRUE(frontiers(*view_, box).empty());
      EXPECT_TRUE(MapView::of(map_, box)->bounds().isEmpty());
    }
  }
}

TEST_F(OddQuestions, OfNoSize) {
  const Contents all = view_->in_box(view_->bounds());
  for (const double odd : {kNone, kEndless, -kEndless, 0.0, -0.3}) {
    SCOPED_TRACE(odd);
    expect_nothing_in(view_->in_ball(place_, odd));
    const std::vector<Vector3d> path{place_, {0.4, 0.5, 0}};
    expect_same_contents(view_->flown(path, odd)->in_box(view_->bounds()), all);
    const DistanceField field =
        DistanceField::of(*view_, {place_.array() - 0.5, place_.array() + 0.5}, UnknownSpace::free, odd);
    EXPECT_EQ(field.size().maxCoeff() > 0, odd == kEndless);
    for (const UnknownSpace unknown : kBoth) {
      expect_blocked_at_once(view_->sweep(path, odd, unknown));
      if (!std::isfinite(odd)) expect_all_blocked(sectors(*view_, place_, odd, 0.5, 0.5, unknown));
      if (!std::isnan(odd)) continue;
      expect_all_blocked(sectors(*view_, place_, 3, odd, 0.5, unknown));
      expect_all_blocked(sectors(*view_, place_, 3, 0.5, odd, unknown));
      expect_blocked_at_once(view_->ray(place_, {1, 0, 0}, odd, unknown));
    }
  }
}

/// Endless where that makes sense: as far as there is anything.
TEST_F(OddQuestions, OfAllThereIs) {
  const AlignedBox3d all(Vector3d::Constant(-kEndless), Vector3d::Constant(kEndless));
  const Contents contents = view_->in_box(all);
  EXPECT_EQ(contents.occupied, map_.counts().occupied);
  EXPECT_EQ(contents.free, map_.counts().free);
  EXPECT_EQ(frontiers(*view_, all).size(), frontiers(*view_, view_->bounds()).size());
  EXPECT_EQ(MapView::of(map_, all)->bounds().sizes(), view_->bounds().sizes());
  EXPECT_TRUE(MapView::of(map_, AlignedBox3d())->bounds().isEmpty()) << "an empty box holds nothing";
  for (const UnknownSpace unknown : kBoth) {
    const auto far = view_->ray(place_, {1, 2, 0.1}, 1e4, unknown);
    for (const double length : {1.0, 1e-200, 1e200, 5e-324}) {
      Vector3d direction = length * Vector3d(1, 2, 0.1);
      if (length < 1e-300) direction = {0, 5e-324, 0};
      const auto endless = view_->ray(place_, direction, kEndless, unknown);
      if (length < 1e-300) {
        const auto along_y = view_->ray(place_, {0, 1, 0}, 1e4, unknown);
        ASSERT_EQ(endless.has_value(), along_y.has_value());
        if (endless) {
          EXPECT_DOUBLE_EQ(endless->length, along_y->length);
        }
        continue;
      }
      ASSERT_EQ(endless.has_value(), far.has_value()) << length;
      if (endless) {
        EXPECT_NEAR(endless->length, far->length, 1e-9);
      }
    }
    // Longer than a length can be.
    EXPECT_TRUE(view_->sweep(std::vector<Vector3d>{place_, {1e200, 0, 0}}, 0.3, unknown));
  }
  // From beyond one border to beyond the other: what lies between is freed, and nothing is waited for.
  const std::vector<Vector3d> across{{-1e9, place_.y(), place_.z()}, {1e9, place_.y(), place_.z()}};
  const auto flown = view_->flown(across, 0.3);
  EXPECT_FALSE(flown->at({3000, place_.y(), place_.z()}) == Occupancy::unknown);
  EXPECT_NE(flown->at(place_), Occupancy::unknown);
}

/// What a map can hold ends 32768 voxels from its origin.
TEST_F(OddQuestions, AHundredKilometresFromTheOrigin) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Vector3d away = side * Vector3d::Unit(axis);
      const Vector3d far = place_ + 1e5 * away;
      SCOPED_TRACE(testing::Message() << far.transpose());
      EXPECT_EQ(map_.at(far), Occupancy::unknown);
      EXPECT_EQ(view_->at(far), Occupancy::unknown);
      expect_nothing_in(view_->in_ball(far, 2));
      expect_nothing_in(view_->in_box({far.array() - 1, far.array() + 1}));
      EXPECT_TRUE(frontiers(*view_, {far.array() - 1, far.array() + 1}).empty());
      EXPECT_TRUE(MapView::of(map_, {far.array() - 9, far.array() + 9})->bounds().isEmpty());
      const DistanceField field =
          DistanceField::of(*view_, {far.array() - 1, far.array() + 1}, UnknownSpace::blocked);
      EXPECT_FALSE(field.distance(far) > 0);
      expect_all_blocked(sectors(*view_, far, 5, 0.5, 0.5, UnknownSpace::blocked));
      for (const double distance : sectors(*view_, far, 5, 0.5, 0.5, UnknownSpace::free))
        EXPECT_EQ(distance, kEndless);
      expect_blocked_at_once(view_->ray(far, -away, 2e5, UnknownSpace::blocked));
      expect_blocked_at_once(view_->sweep(std::vector<Vector3d>{far, place_}, 0.3, UnknownSpace::blocked));
      // On the way there and back it is the map that decides.
      const auto there = view_->sweep(std::vector<Vector3d>{place_, far}, 0.3, UnknownSpace::free);
      const auto short_of =
          view_->sweep(std::vector<Vector3d>{place_, place_ + 20 * away}, 0.3, UnknownSpace::free);
      ASSERT_EQ(there.has_value(), short_of.has_value());
      if (there) {
        EXPECT_NEAR(there->length, short_of->length, 1e-6);
      }
      const auto in_the_dark = view_->sweep(std::vector<Vector3d>{place_, far}, 0.3, UnknownSpace::blocked);
      ASSERT_TRUE(in_the_dark);
      EXPECT_LT(in_the_dark->length, 30);
    }
}

std::vector<MapLeaf> leaves_of_map(const OccupancyMap& map) {
  std::vector<MapLeaf> all;
  map.for_each_leaf([&](const MapLeaf& leaf) { all.push_back(leaf); });
  return all;
}

bool are_same(const std::vector<MapLeaf>& a, const std::vector<MapLeaf>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const MapLeaf& x, const MapLeaf& y) {
    return x.code == y.code && x.depth == y.depth && x.log_odds == y.log_odds;
  });
}

class OddImages : public testing::Test {
 protected:
  simulation::AnalyticFlight flight_ =
      *simulation::make_analytic_flight("forward", 2, simulation::analytic_camera(64, 48));
  OccupancyMap map_ = map_of(flight_, 0.01);
  std::shared_ptr<const MapView> view_ = MapView::of(map_);
  std::vector<MapLeaf> before_ = leaves_of_map(map_);

  MapChange expect_no_change(const Camera& camera, const Pose& pose) {
    MapChange change = map_.integrate(depth_image(flight_, 1, 0.01), camera, pose);
    EXPECT_TRUE(change.touched.empty() && change.became_occupied.empty() && change.became_free.empty());
    EXPECT_TRUE(are_same(leaves_of_map(map_), before_));
    view_ = view_->after(map_, change);
    EXPECT_EQ(view_->memory(), MapView::of(map_)->memory());
    return change;
  }
};

TEST_F(OddImages, FromNoPlaceChangeNothing) {
  const Pose good = flight_.T_world_camera[1];
  ASSERT_GT(before_.size(), 1000U);
  for (const Vector3d& place : spoiled(good.translation)) {
    Pose pose = good;
    pose.translation = place;
    expect_no_change(flight_.camera, pose);
  }
  Pose far = good;
  far.translation.y() = 1e307;
  expect_no_change(flight_.camera, far);
  for (const double value : {kNone, kEndless, 1e200}) {
    Pose pose = good;
    pose.rotation.coeffs()[2] = value;
    expect_no_change(flight_.camera, pose);
  }
  Pose none = good;
  none.rotation.coeffs().setZero();
  expect_no_change(flight_.camera, none);
  for (double Camera::*const number : {&Camera::fx, &Camera::fy, &Camera::cx, &Camera::cy})
    for (const double value : {kNone, kEndless, -kEndless}) {
      Camera camera = flight_.camera;
      camera.*number = value;
      expect_no_change(camera, good);
    }
  Camera blind = flight_.camera;
  blind.fx = 0;
  expect_no_change(blind, good);
}

TEST_F(OddImages, FromAHundredKilometresAwayChangeNothingAndAreCounted) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1e5, 1e5}) {
      Pose pose = flight_.T_world_camera[1];
      pose.translation[axis] += side;
      EXPECT_GT(expect_no_change(flight_.camera, pose).outside, 500U);
    }
  map_.integrate(depth_image(flight_, 1, 0.01), flight_.camera, flight_.T_world_camera[1]);
  EXPECT_FALSE(are_same(leaves_of_map(map_), before_)) << "and then the flight goes on";
}

/// Of an image whose every pixel says this: the map that it makes.
OccupancyMap map_of_pixels(const Camera& camera, float depth, float variance, float bound, bool has_bound) {
  DepthImage image;
  image.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(depth));
  image.variance = cv::Mat(image.depth.size(), CV_32FC1, cv::Scalar(variance));
  if (has_bound) image.bound = cv::Mat(image.depth.size(), CV_32FC1, cv::Scalar(bound));
  MapOptions options;
  options.looks_baseline = 0;
  OccupancyMap map = std::move(OccupancyMap::create(options)).value();
  map.integrate(image, camera, Pose{});
  return map;
}

TEST_F(OddImages, OfNoDepthShowNothing) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  for (const float odd : {kNaN, -kInf, -1.0F, 0.0F, -0.0F}) {
    EXPECT_TRUE(map_of_pixels(flight_.camera, odd, 0, 0, false).bounds().isEmpty()) << odd;
    EXPECT_TRUE(map_of_pixels(flight_.camera, odd, 0, odd, true).bounds().isEmpty()) << odd;
    EXPECT_EQ(map_of_pixels(flight_.camera, 5, 0, odd, true).counts().free, 0U) << odd;
  }
  for (const float odd : {kNaN, kInf})
    EXPECT_TRUE(map_of_pixels(flight_.camera, 5, odd, 0, false).bounds().isEmpty()) << odd;
  for (const float odd : {-1.0F, -kInf})
    EXPECT_EQ(map_of_pixels(flight_.camera, 5, odd, 0, false).counts().free, 0U) << odd;
  // Farther than anything: free up to the range, with nothing at its end.
  EXPECT_TRUE(are_same(leaves_of_map(map_of_pixels(flight_.camera, kInf, 0, 0, false)),
                       leaves_of_map(map_of_pixels(flight_.camera, 1e9F, 0, 0, false))));
  EXPECT_TRUE(are_same(leaves_of_map(map_of_pixels(flight_.camera, kNaN, 0, kInf, true)),
                       leaves_of_map(map_of_pixels(flight_.camera, kNaN, 0, 1e9F, true))));
  EXPECT_GT(map_of_pixels(flight_.camera, kInf, 0, 0, false).counts().free, 1000U);
}

}  // namespace
}  // namespace pade::mapping
