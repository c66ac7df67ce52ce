// The way ahead in maps of known content.
#include "pade/evaluation/map/corridor.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/map/known_map.hpp"

namespace pade::evaluation {
namespace {

constexpr double kRadius = 0.35;

TEST(KnownFreeReach, EndsARadiusBeforeTheWall) {
  const auto map = test::free_lane(8);
  for (const double start : {0.5, 2.0, 6.0}) {
    const FlightEnd end{{start, 0.02, -0.03}, Eigen::Vector3d::UnitX()};
    EXPECT_NEAR(known_free_reach(map, end, kRadius, 15).distance, 8 - kRadius - start, 0.026) << start;
  }
}

TEST(KnownFreeReach, EndsAtUnknownSpaceToo) {
  const auto map = test::free_lane(8);
  // Obliquely out of the lane, whose side is 1.5 m from the axis.
  const Eigen::Vector3d direction = Eigen::Vector3d(1, 1, 0).normalized();
  const double expected = (1.5 - kRadius) * std::sqrt(2.0);
  EXPECT_NEAR(known_free_reach(map, {{2, 0, 0}, direction}, kRadius, 15).distance, expected, 0.03);
}

TEST(KnownFreeReach, SaysWhatItMeets) {
  const auto map = test::free_lane(8);
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX();
  EXPECT_EQ(known_free_reach(map, {{1, 0, 0}, forward}, kRadius, 15).stopped_by,
            mapping::Occupancy::occupied);
  EXPECT_EQ(known_free_reach(map, {{1, 0, 0}, forward}, kRadius, 3).stopped_by, mapping::Occupancy::free);
  EXPECT_EQ(known_free_reach(map, {{4, 0, 0}, Eigen::Vector3d::UnitZ()}, kRadius, 15).stopped_by,
            mapping::Occupancy::unknown);
}

TEST(KnownFreeReach, IsAtMostWhatIsAskedFor) {
  const auto map = test::free_lane(8);
  EXPECT_NEAR(known_free_reach(map, {{1, 0, 0}, Eigen::Vector3d::UnitX()}, kRadius, 3).distance, 3, 0.026);
}

TEST(KnownFreeReach, TakesTheVehiclesOwnPlaceAsFree) {
  // The lane begins at x = 0; a vehicle there has unknown space around its rear half.
  const auto map = test::free_lane(8);
  EXPECT_NEAR(known_free_reach(map, {{0.05, 0, 0}, Eigen::Vector3d::UnitX()}, kRadius, 15).distance, 7.6,
              0.026);
  // Well outside there is nothing known ahead at all.
  EXPECT_LT(known_free_reach(map, {{-3, 0, 0}, Eigen::Vector3d::UnitX()}, kRadius, 15).distance, 0.11);
}

TEST(KnownFreeReach, SeesAThinPoleBesideTheAxis) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  test::fill(*tree, {0.05, -1.45, -1.45}, {9.95, 1.45, 1.45}, false);
  test::fill(*tree, {5.05, 0.25, -1.45}, {5.05, 0.25, 1.45}, true);
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  // The pole covers x 5.0 .. 5.1, y 0.2 .. 0.3: touched where (5 - s)^2 + 0.2^2 = r^2.
  const double expected = 5 - std::sqrt(kRadius * kRadius - 0.2 * 0.2) - 1;
  EXPECT_NEAR(known_free_reach(map, {{1, 0, 0}, Eigen::Vector3d::UnitX()}, kRadius, 15).distance, expected,
              0.026);
  EXPECT_NEAR(known_free_reach(map, {{1, 0, 0}, Eigen::Vector3d::UnitX()}, 0.15, 15).distance, 9 - 0.15,
              0.026);
}

TEST(EndOfFlight, IsTheLastHalfMetreOrTheCamera) {
  const Eigen::Vector3d look(0, 0, 1);
  const FlightEnd turned = end_of_flight({{0, 0, 0}, {5, 0, 0}, {5, 0.3, 0}, {5, 0.6, 0}}, look);
  EXPECT_TRUE(turned.position.isApprox(Eigen::Vector3d(5, 0.6, 0)));
  EXPECT_TRUE(turned.direction.isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(end_of_flight({{0, 0, 0}, {0.2, 0, 0}}, look).direction.isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(end_of_flight({{0, 0, 0}, {0.02, 0, 0}}, look).direction.isApprox(look)) << "hovering";
  EXPECT_TRUE(end_of_flight({{0, 0, 0}}, Eigen::Vector3d::Zero()).direction.isZero()) << "nobody knows";
}

TEST(Slice, HasTheStateOfEveryPlace) {
  const auto map = test::free_lane(2);
  // From above: x to the right, y upward.
  const cv::Mat slice =
      slice_of(map, {-0.05, 1.65, 0}, Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(0, -0.1, 0), {25, 34});
  for (int row = 0; row < slice.rows; ++row) {
    for (int column = 0; column < slice.cols; ++column) {
      const bool beside = row < 2 || row >= 32;
      const auto expected = beside || column < 1 || column > 22 ? mapping::Occupancy::unknown
                            : column > 20                       ? mapping::Occupancy::occupied
                                                                : mapping::Occupancy::free;
      EXPECT_EQ(slice.at<std::uint8_t>(row, column), static_cast<std::uint8_t>(expected))
          << row << ", " << column;
    }
  }
}

}  // namespace
}  // namespace pade::evaluation
