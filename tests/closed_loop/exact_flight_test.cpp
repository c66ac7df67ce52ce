#include "pade/closed_loop/exact_flight.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "pade/closed_loop/world_measures.hpp"

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

/// Below the goal is not there: it climbs on the way.
TEST(ExactFlight, ArrivesInHeightToo) {
  const Place place = columns({{5, 0.1}});
  ExactFlightOptions options = quick();
  options.planner.vehicle.highest = 6;
  const auto record = fly_exact({place.scene, place.surface, {0, 0, 1.6}, {14, 0, 2.9}}, options);
  ASSERT_TRUE(record.ok());
  EXPECT_EQ(record->outcome, Outcome::arrived);
  EXPECT_LT(std::abs(record->goal_height), 1);
  EXPECT_LT(record->goal_distance, 1);
}

/// Wherever a thin thing stands, what is declared free about the start does not reach it.
TEST(FreeAbout, NeverReachesWhatStandsThere) {
  for (double azimuth = 0; azimuth < 6.28; azimuth += 0.37) {
    for (const double away : {0.7, 1.1, 1.6}) {
      const Place place = columns({{away * std::cos(azimuth), away * std::sin(azimuth)}});
      const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {20, 0, 1.6}};
      const double free = free_about(task, 1.2, 1.5);
      EXPECT_LE(free, away - column_radius) << azimuth;
      EXPECT_GT(free, away - column_radius - 0.25) << azimuth;
    }
  }
  const Place open = columns({{2, 0}});
  EXPECT_EQ(free_about({open.scene, open.surface, {0, 0, 1.6}, {20, 0, 1.6}}, 1.2, 1.5), 1.5);
}

/// Nearer to the goal than 1 m is there, and may be free where the goal is not.
TEST(ExactFlight, ArrivesBesideAGoalThatSomethingStandsAt) {
  const FlightRecord record = flown(columns({{9, 0}}), 9, quick());
  EXPECT_EQ(record.outcome, Outcome::arrived);
  EXPECT_GT(record.least_clearance, 0.35);
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

/// The climb is no part of the way: not its length, not its end, which is a standstill, not its time.
TEST(FlightWatch, MeasuresTheWayAndNotTheClimb) {
  const Place place = columns({});
  const FlightTask task{place.scene, place.surface, {0, 0, 1.6}, {20, 0, 1.6}};
  FlightWatch watch(task, 0.35);
  for (int i = 0; i <= 800; ++i) {
    planning::MotionState state;
    state.time = i / 100.0;
    const bool climbs = state.time < 2;
    const bool rests = !climbs && state.time < 3;
    state.position = {climbs || rests ? 0 : 2 * (state.time - 3), 0, climbs ? 0.4 + 0.6 * state.time : 1.6};
    state.velocity = {climbs || rests ? 0.0 : 2, 0, climbs ? 0.6 : 0};
    EXPECT_TRUE(watch.look(state));
  }
  const FlightRecord record = watch.finished(Outcome::timed_out, 2.5);
  EXPECT_EQ(record.stops, 0);
  EXPECT_FALSE(record.stands);
  EXPECT_NEAR(record.length, 10, 0.03);
  EXPECT_NEAR(record.goal_velocity, 10 / 5.5, 0.01);
  EXPECT_DOUBLE_EQ(record.duration, 8);
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
