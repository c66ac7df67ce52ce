// `pade navigate` on raw GNSS alone.
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/io/text.hpp"
#include "pade/navigation/gnss/positioning.hpp"

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Two epochs of ten satellites over a place, and the place.
std::string ranges_over(const Eigen::Vector3d& place) {
  const Eigen::Matrix3d axes = gnss::enu_axes(gnss::geodetic_of(place));
  std::string text;
  for (int epoch = 0; epoch < 2; ++epoch) {
    for (int i = 0; i < 10; ++i) {
      const double azimuth = 2.4 * i, elevation = 0.3 + 0.11 * i;
      const Eigen::Vector3d sight(std::cos(elevation) * std::sin(azimuth),
                                  std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
      const Eigen::Vector3d satellite = place + 2.2e7 * (axes.transpose() * sight);
      text += fmt::format("pseudorange3 {} {:.6f} 25 {:.6f} {:.6f} {:.6f} {} 1 45 44\n", epoch,
                          gnss::range_between(satellite, place) + 777, satellite.x(), satellite.y(),
                          satellite.z(), i + 1);
    }
    text += fmt::format("point3 {} {:.6f} {:.6f} {:.6f}\n", epoch, place.x() + 3, place.y(), place.z());
  }
  return text;
}

TEST(RawGnssCommand, WritesAFolderThatOthersCanRead) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "street.txt") << ranges_over(gnss::ecef_of({0.85, 0.16, 300}));
  const auto out = folder / "out";
  const std::string command =
      test::kPade + " navigate " + (folder / "street.txt").string() + " --out " + out.string();
  const auto run = test::shell(command);
  ASSERT_EQ(run.code, 0) << run.text;
  EXPECT_THAT(run.text, HasSubstr("2 epochs: 2 with a position of 10.0 satellites"));
  for (const char* file : {"epochs.csv", "residuals.csv", "gnss.csv", "navigation.json", "report.html"}) {
    EXPECT_TRUE(fs::exists(out / file)) << file;
  }
  const auto json = nlohmann::json::parse(*io::read_file(out / "navigation.json"));
  EXPECT_NEAR(std::hypot(json["against_truth"]["horizontal_rms_m"].get<double>(),
                         json["against_truth"]["vertical_rms_m"].get<double>()),
              3, 1e-3);
  EXPECT_EQ(json["satellites"]["used"], 20);
  EXPECT_THAT(*io::read_file(out / "residuals.csv"), HasSubstr(",G10,"));
  EXPECT_NE(test::shell(command).code, 0);  // it is there already
  EXPECT_EQ(test::shell(command + " --force").code, 0);
}

/// A car that drives east by 5 m/s over a place for 20 s, with its odometry.
std::string drive_over(const Eigen::Vector3d& start) {
  const Eigen::Matrix3d axes = gnss::enu_axes(gnss::geodetic_of(start));
  std::string text;
  for (int epoch = 0; epoch < 100; ++epoch) {
    const double t = 0.2 * epoch;
    const Eigen::Vector3d place = start + axes.transpose() * Eigen::Vector3d(5 * t, 0, 0);
    for (int i = 0; i < 10; ++i) {
      const double azimuth = 2.4 * i, elevation = 0.3 + 0.11 * i;
      const Eigen::Vector3d sight(std::cos(elevation) * std::sin(azimuth),
                                  std::cos(elevation) * std::cos(azimuth), std::sin(elevation));
      const Eigen::Vector3d satellite = start + 2.2e7 * (axes.transpose() * sight);
      text += fmt::format("pseudorange3 {:.1f} {:.6f} 4 {:.6f} {:.6f} {:.6f} {} 1 45 44\n", t,
                          gnss::range_between(satellite, place) + 777, satellite.x(), satellite.y(),
                          satellite.z(), i + 1);
    }
    text += fmt::format("odom3 {:.1f} 5 0 0 0 0 0 0.0025 1 1 1 1 4e-6\n", t);
    text += fmt::format("point3 {:.1f} {:.6f} {:.6f} {:.6f}\n", t, place.x(), place.y(), place.z());
  }
  return text;
}

TEST(RawGnssCommand, PlaysRangesWithOdometryAndNoImu) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder / "car");
  std::ofstream(folder / "car" / "street.txt") << drive_over(gnss::ecef_of({0.85, 0.16, 300}));
  for (const std::string coupling : {"tight", "loose"}) {
    const auto out = folder / coupling;
    const std::string command = test::kPade + " navigate " + (folder / "car").string() + " --raw-coupling " +
                                coupling + " --out " + out.string();
    const auto run = test::shell(command);
    ASSERT_EQ(run.code, 0) << run.text;
    EXPECT_THAT(run.text,
                HasSubstr("100 of 100 epochs with a position, from raw GNSS and 100 samples of odometry"));
    EXPECT_EQ(run.text.find(" doubted, 0 refused") != std::string::npos, coupling == "tight");
    const auto json = nlohmann::json::parse(*io::read_file(out / "navigation.json"));
    EXPECT_EQ(json["coupling"], coupling);
    // Until the yaw is known a car that drives seems to stand, as far as ranges of lasting errors say.
    EXPECT_LT(json["against_truth"]["horizontal_rms_m"].get<double>(), 5);
    EXPECT_TRUE(json["yaw_known_after_s"].is_number());
    EXPECT_EQ(json["options"]["odometry"]["correlation_time"], 5);
    for (const char* file :
         {"positions.csv", "trajectory.txt", "residuals.csv", "raw_report.html", "report.html"}) {
      EXPECT_TRUE(fs::exists(out / file)) << file;
    }
    EXPECT_EQ(fs::exists(out / "ranges.csv"), coupling == "tight");
    EXPECT_NE(test::shell(command).code, 0);  // it is there already
    EXPECT_EQ(test::shell(command + " --force").code, 0);
  }
}

TEST(RawGnssCommand, RefusesOptionsOfRawGnssWhereThereIsNone) {
  const test::TemporaryFolder folder;
  for (const std::string option : {"--raw-gnss x", "--elevation-mask 5"}) {
    const auto run = test::shell(test::kPade + " navigate " + folder.path().string() + " --out " +
                                 (folder / "out").string() + " " + option);
    EXPECT_EQ(run.code, 1);
    EXPECT_THAT(run.text, HasSubstr("found it without --raw-coupling"));
  }
}

TEST(RawGnssCommand, RefusesWhatWouldDoNothing) {
  const test::TemporaryFolder folder;
  const auto street = (folder / "street.txt").string();
  const auto out = folder / "out";
  const auto refused = [&](const std::string& options) {
    const auto run =
        test::shell(test::kPade + " navigate " + street + " --out " + out.string() + " " + options);
    EXPECT_EQ(run.code, 1) << options << run.text;
    EXPECT_FALSE(fs::exists(out)) << options;
    return run.text;
  };
  std::ofstream(street) << ranges_over(gnss::ecef_of({0.85, 0.16, 300}));
  EXPECT_THAT(refused("--raw-coupling tight"), HasSubstr("expected odometry beside them (odom3 lines)"));
  EXPECT_THAT(refused("--heading 3"), HasSubstr("--heading: found it with raw GNSS alone, without an IMU"));
  std::ofstream(street) << drive_over(gnss::ecef_of({0.85, 0.16, 300}));
  EXPECT_THAT(refused("--raw-coupling tight --vehicle road"),
              HasSubstr("--vehicle: found it with odometry and no IMU"));
  const auto run = test::shell(test::kPade + " navigate --raw " + street + " --out " + out.string());
  EXPECT_EQ(run.code, 0) << run.text;
  EXPECT_THAT(run.text, HasSubstr("100 samples of odometry are not used; --raw-coupling tight uses them"));
}

TEST(RawGnssCommand, RefusesAFolderWithoutRawGnssAndLeavesNothing) {
  const test::TemporaryFolder folder;
  fs::create_directory(folder / "log");
  std::ofstream(folder / "log" / "notes.txt") << "nothing\n";
  const auto run = test::shell(test::kPade + " navigate --raw " + (folder / "log").string() + " --out " +
                               (folder / "out").string());
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.text, HasSubstr("found no raw GNSS, expected RINEX 3 observations, UBX, or libRSF's"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(RawGnssCommand, SaysOfAnEmptyFileWhatWasExpected) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "rover.obs") << "";
  const auto run = test::shell(test::kPade + " navigate " + (folder / "rover.obs").string() + " --out " +
                               (folder / "out").string());
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.text, HasSubstr("expected RINEX 3 observations, UBX"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(RawGnssCommand, RefusesAMaskThatIsNoAngle) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "street.txt") << ranges_over(gnss::ecef_of({0.85, 0.16, 300}));
  for (const char* mask : {"nan", "inf", "-1", "61", "ten", ""}) {
    const auto run = test::shell(test::kPade + " navigate " + (folder / "street.txt").string() + " --out " +
                                 (folder / "out").string() + " --elevation-mask='" + mask + "'");
    EXPECT_NE(run.code, 0) << mask;
    EXPECT_FALSE(fs::exists(folder / "out")) << mask;
  }
}

TEST(RawGnssCommand, PutsRawGnssIntoTheFilter) {
  const fs::path data = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation/static_vn310_raw";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const test::TemporaryFolder folder;
  for (const std::string coupling : {"tight", "loose"}) {
    const auto out = folder / coupling;
    const auto run = test::shell(test::kPade + " navigate " + data.string() + " --heading 0 --raw-coupling " +
                                 coupling + " --out " + out.string());
    ASSERT_EQ(run.code, 0) << run.text;
    const auto json = nlohmann::json::parse(*io::read_file(out / "navigation.json"));
    const bool tight = coupling == "tight";
    EXPECT_EQ(json["raw_gnss"]["phases"]["used"].get<int>() > 5000, tight);
    EXPECT_EQ(run.text.find("satellite by satellite") != std::string::npos, tight);
    EXPECT_THAT(run.text, HasSubstr("no ephemeris: E31 ("));
    EXPECT_THAT(*io::read_file(out / "report.html"), HasSubstr("Slips of the phases"));
    for (const char* file : {"trajectory.txt", "residuals.csv", "raw_report.html", "report.html"}) {
      EXPECT_TRUE(fs::exists(out / file)) << file;
    }
  }
}

TEST(RawGnssCommand, RefusesRawGnssOfAnotherTime) {
  const fs::path data = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const test::TemporaryFolder folder;
  const auto run = test::shell(test::kPade + " navigate " + (data / "mav_mh01").string() +
                               " --gnss gnss_spp_5hz.csv --raw-coupling tight --raw-gnss " +
                               (data / "static_vn310_raw").string() + " --out " + (folder / "out").string());
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.text, HasSubstr("expected that they overlap in GPS time"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace pade
