#include "pade/closed_loop/exact_flight.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "columns.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;

ExactFlightOptions quick() {
  ExactFlightOptions options;
  options.width = 160;
  options.map.range = 8;
  options.time_limit = 40;
  return options;
}

FlightRecord flown(const Place& place, double way, const ExactFlightOptions& options) {
  auto record = fly_exact({place.scene, place.surface, {0, 0, 1.6}, {way, 0, 1.6}}, options);
  EXPECT_TRUE(record.ok());
  return std::move(record).value();
}

TEST(ExactFlight, GoesAroundColumnsThatStandInItsWay) {
  const Place place = columns({{5, 0.1}, {9, -1.2}, {9, 1.0}, {12, 0}});
  const FlightRecord record = flown(place, 16, quick());
  EXPECT_EQ(record.outcome, Outcome::arrived);
  EXPECT_GT(record.least_clearance, 0.35);
  EXPECT_LT(record.least_clearance, 1);  // it had to pass between them
  EXPECT_GT(record.goal_velocity, 0.7);
  EXPECT_GE(record.length, 15 - 0.2);
  for (const FlightSample& s : record.samples) {
    // The clearance in closed form, of meadow and columns.
    double nearest = s.state.position.z();
    for (const Eigen::Vector2d& p : {Eigen::Vector2d(5, 0.1), {9, -1.2}, {9, 1.0}, {12, 0}})
      nearest = std::min(nearest, (s.state.position.head<2>() - p).norm() - column_radius);
    EXPECT_NEAR(s.clearance, std::min(nearest, 2.0), 1e-6);
  }
}

TEST(ExactFlight, StandsStillBeforeAWallWithoutAWayAndTouchesNothing) {
  std::vector<Eigen::Vector2d> wall;
  for (double angle = 0; angle < 6.28; angle += 0.1)
    wall.emplace_back(6 * std::cos(angle), 6 * std::sin(angle));
  ExactFlightOptions options = quick();
  options.time_limit = 15;
  const FlightRecord record = flown(columns(wall), 16, options);
  EXPECT_EQ(record.outcome, Outcome::timed_out);
  EXPECT_GT(record.least_clearance, 0.35);
}

TEST(ExactFlight, TheSameFlightHasTheSameBits) {
  const Place place = columns({{5, 0.1}});
  const FlightRecord a = flown(place, 8, quick());
  const FlightRecord b = flown(place, 8, quick());
  ASSERT_EQ(a.samples.size(), b.samples.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i)
    EXPECT_EQ(a.samples[i].state.position, b.samples[i].state.position);
}

TEST(ExactFlight, RefusesOptionsThatMakeNoSense) {
  const Place place = columns({});
  ExactFlightOptions options;
  options.planner.vehicle.speed = 0;
  EXPECT_FALSE(fly_exact({place.scene, place.surface, {0, 0, 1}, {9, 0, 1}}, options).ok());
}

}  // namespace
}  // namespace pade::closed_loop
