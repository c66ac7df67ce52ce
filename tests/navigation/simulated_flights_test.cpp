// The filter on what the instruments of the shipped flights record (config/flights), through the files that
// the simulator writes: errors of the motion between frames and their consistency.
#include <cstdio>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/io/navigation_log.hpp"
#include "pade/pipeline/navigation_run.hpp"
#include "pade/simulation/flight.hpp"
#include "pade/simulation/sensor_files.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;

/// The log of a flight as `pade navigate` reads it.
NavigationLog log_of(const simulation::Flight& flight, std::uint64_t seed) {
  const auto path = simulation::Trajectory::through(flight.waypoints, flight.trajectory);
  EXPECT_TRUE(path);
  const auto files = simulation::sensor_files(*path, flight.sensors, seed);
  NavigationLog log;
  log.imu = *io::parse_imu(files.at("imu.csv"), "imu.csv", log.remarks);
  log.gnss = *io::parse_gnss(files.at("gnss.csv"), "gnss.csv", {}, log.remarks);
  log.barometer = *io::parse_barometer(files.at("baro.csv"), "baro.csv", log.remarks);
  log.magnetometer = *io::parse_magnetometer(files.at("mag.csv"), "mag.csv", log.remarks);
  log.truth = *io::parse_body_truth(files.at("body_truth.txt"), "body_truth.txt", log.remarks);
  return log;
}

class ShippedFlights : public testing::TestWithParam<const char*> {};

TEST_P(ShippedFlights, GiveHonestMotionBetweenFramesFromTheirFirstSeconds) {
  const auto flight = simulation::read_flight(fs::path(PADE_SOURCE_DIR) / "config/flights" /
                                              (GetParam() + std::string(".yaml")));
  ASSERT_TRUE(flight) << flight.error().message;
  std::vector<double> median, t95, rotation, nees, rotation_nees, first;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto log = log_of(*flight, seed);
    NavigationRunOptions options;
    const auto run = run_navigation(log, options);
    ASSERT_TRUE(run.score) << "seed " << seed;
    median.push_back(100 * run.score->translation_median);
    t95.push_back(100 * run.score->translation_95);
    rotation.push_back(run.score->rotation_95 * 180 / std::numbers::pi);
    nees.push_back(run.score->nees_mean);
    rotation_nees.push_back(run.score->rotation_nees_mean);
    first.push_back(run.frames.front().time.seconds());
  }
  const auto middle = [](const std::vector<double>& v) { return evaluation::quantile(v, 0.5); };
  const auto most = [](const std::vector<double>& v) { return evaluation::quantile(v, 1); };
  std::printf(
      "%-9s first pose at %.1f s; translation %.2f cm median, %.2f cm 95 %% (worst of 10 seeds %.2f), NEES "
      "%.2f (worst "
      "%.2f); rotation 95 %% %.3f deg, NEES %.2f (worst %.2f)\n",
      GetParam(), middle(first), middle(median), middle(t95), most(t95), middle(nees), most(nees),
      middle(rotation), middle(rotation_nees), most(rotation_nees));
  EXPECT_LT(most(t95), 5.5) << "of about 20 cm";
  EXPECT_LT(middle(nees), 5);
  EXPECT_GT(middle(nees), 0.5);
  EXPECT_LT(middle(rotation_nees), 6);
}
INSTANTIATE_TEST_SUITE_P(Worlds, ShippedFlights,
                         testing::Values("building", "corridor", "forest", "rubble", "street"),
                         [](const auto& parameter) { return std::string(parameter.param); });

}  // namespace
}  // namespace pade
