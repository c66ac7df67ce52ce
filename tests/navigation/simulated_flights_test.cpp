// The filter on what the instruments of the shipped flights record (config/flights), through the files that
// the simulator writes: errors of the motion between frames and their consistency.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <numeric>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/navigation/navigation_run.hpp"
#include "pade/offline/poses_from_sensors.hpp"
#include "pade/report/navigation_report.hpp"
#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/flight/sensor_files.hpp"

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
  std::vector<double> covered, t95, direction_95, rotation_95, nees, rotation_nees, direction_nees,
      length_nees;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    NavigationRunOptions options;
    for (int k = 0; k < flight->frames; ++k) {
      options.frames.push_back(Time::from_seconds(flight->first_frame + k / flight->frame_rate));
    }
    const NavigationLog log = log_of(*flight, seed);
    const NavigationRun run = run_navigation(log, options);
    const auto score = score_motions(log, options, run);
    ASSERT_TRUE(score) << "seed " << seed;
    EXPECT_EQ(run.health.filter.times_lost, 0U) << "seed " << seed;
    covered.push_back(static_cast<double>(run.frames.size()) / flight->frames);
    t95.push_back(100 * score->translation_95);
    direction_95.push_back(score->direction_95 * 180 / std::numbers::pi);
    rotation_95.push_back(score->rotation_95 * 180 / std::numbers::pi);
    nees.push_back(score->nees_mean);
    rotation_nees.push_back(score->rotation_nees_mean);
    direction_nees.push_back(score->direction_nees_mean);
    length_nees.push_back(score->length_nees_mean);
  }
  const auto middle = [](const std::vector<double>& v) { return evaluation::quantile(v, 0.5); };
  const auto most = [](const std::vector<double>& v) { return evaluation::quantile(v, 1); };
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  std::printf(
      "%-9s frames with a pose %.0f %% (least of 10 seeds %.0f); 95 %%: translation %.2f cm (most %.2f), "
      "direction "
      "%.1f deg, rotation %.3f deg (most %.3f); mean NEES: translation %.2f, rotation %.2f, direction (2) "
      "%.2f, "
      "length (1) %.2f\n",
      GetParam(), 100 * middle(covered), 100 * evaluation::quantile(covered, 0), middle(t95), most(t95),
      middle(direction_95), middle(rotation_95), most(rotation_95), mean(nees), mean(rotation_nees),
      mean(direction_nees), mean(length_nees));
  EXPECT_GT(evaluation::quantile(covered, 0), 0.95);
  EXPECT_LT(most(t95), 5.5) << "of about 20 cm";
  EXPECT_GT(mean(nees), 1);
  EXPECT_LT(mean(nees), 5);
  EXPECT_GT(mean(rotation_nees), 1.8);
  EXPECT_LT(mean(rotation_nees), 5);
}
INSTANTIATE_TEST_SUITE_P(Worlds, ShippedFlights,
                         testing::Values("building", "corridor", "forest", "rubble", "street"),
                         [](const auto& parameter) { return std::string(parameter.param); });

/// A folder with the log of a flight; no IMU samples in (from, to).
fs::path folder_with_gap(double from, double to) {
  const auto flight = simulation::read_flight(fs::path(PADE_SOURCE_DIR) / "config/flights/street.yaml");
  const auto path = simulation::Trajectory::through(flight->waypoints, flight->trajectory);
  fs::path folder = fs::path(testing::TempDir()) / "pade-navigation-gap";
  fs::create_directories(folder);
  for (const auto& [name, text] : simulation::sensor_files(*path, flight->sensors, 1)) {
    std::ofstream file(folder / name);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const double time = std::strtod(line.c_str(), nullptr);
      if (name != "imu.csv" || time <= from || time >= to) file << line << '\n';
    }
  }
  return folder;
}

TEST(CameraTrajectory, KeepsTheLongestChainThatAGapLeavesAndSaysWhatIsLost) {
  std::vector<Time> frames;
  for (int k = 0; k < 125; ++k) frames.push_back(Time::from_seconds(2 + 0.1 * k));
  for (const bool early : {false, true}) {
    const fs::path folder = early ? folder_with_gap(3, 6.5) : folder_with_gap(8, 11.5);
    const auto trajectory = camera_trajectory_from_imu_gnss(folder, frames, {});
    fs::remove_all(folder);
    ASSERT_TRUE(trajectory) << trajectory.error().message;
    EXPECT_EQ(trajectory->times.front() < Time::from_seconds(3), !early);
    EXPECT_GT(trajectory->times.size(), 40U);
    EXPECT_GT(trajectory->frames_left, 5U);
    EXPECT_EQ(trajectory->motions.size() + 1, trajectory->times.size());
    const auto notes = notes_on(*trajectory);
    ASSERT_FALSE(notes.empty());
    EXPECT_NE(notes.back().find(std::to_string(trajectory->frames_left) + " frames"), std::string::npos);
  }
}

}  // namespace
}  // namespace pade
