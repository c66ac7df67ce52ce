// `pade info` as a user meets it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <octomap/OcTree.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/mapping/occupancy_map.hpp"

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;

class InfoOfFlights : public testing::Test {
 protected:
  void copy(const std::string& name) const {
    fs::copy(PADE_SAMPLE_FLIGHT, folder_ / name, fs::copy_options::recursive);
  }
  [[nodiscard]] Outcome info(const std::string& what) const {
    return shell(kPade + " info '" + (folder_ / what).string() + "'");
  }
  test::TemporaryFolder folder_;
};

TEST_F(InfoOfFlights, NamesThoseThatAreBroken) {
  for (const char* name : {"a", "b", "c", "d"}) copy(name);
  fs::remove(folder_ / "b" / "groundtruth.txt");
  fs::remove_all(folder_ / "c" / "rgb");  // what rgb.txt lists
  fs::remove(folder_ / "c" / "rgb.txt");
  for (const auto& entry : fs::directory_iterator(folder_ / "d" / "depth"))
    fs::resize_file(entry.path(), 200);
  fs::create_directories(folder_ / "notes");
  const Outcome table = info("");
  EXPECT_EQ(table.code, 0) << table.text;
  EXPECT_THAT(table.text, testing::ContainsRegex("b +cannot be used: .*groundtruth.txt"));
  EXPECT_THAT(table.text, testing::ContainsRegex("c +cannot be used: "));
  EXPECT_THAT(table.text, testing::ContainsRegex("d +cannot be used: .*depth/"));
  EXPECT_THAT(table.text, testing::Not(HasSubstr("notes")));
  const Outcome outcome = shell(kPade + " info --json " + folder_.path().string());
  const auto json = nlohmann::json::parse(outcome.text);
  ASSERT_EQ(json.at("sequences").size(), 4U) << outcome.text;
  for (const auto& row : json.at("sequences")) {
    const bool good = row.at("folder").get<std::string>().ends_with("/a");
    EXPECT_EQ(row.contains("error"), !good) << row;
    EXPECT_EQ(row.at("scene").is_null(), !good) << row;
  }
}

TEST_F(InfoOfFlights, IsJsonWhateverTheirNames) {
  copy("fl\xffght");
  const Outcome outcome = shell(kPade + " info --json '" + (folder_ / "fl\xffght").string() + "'");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_THAT(nlohmann::json::parse(outcome.text).at("folder").get<std::string>(), HasSubstr("fl\uFFFDght"));
}

TEST_F(InfoOfFlights, RefusesOptionsThatWouldDoNothing) {
  copy("a");
  const auto refused = [&](const std::string& what, const std::string& option) {
    const Outcome outcome = shell(kPade + " info " + (folder_ / what).string() + " " + option);
    EXPECT_EQ(outcome.code, 1) << what << " " << option;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr(option.substr(0, option.find(' '))),
                                             HasSubstr("it would do nothing")))
        << what << " " << option;
  };
  refused("a", "--at 1 2 3");
  refused("", "--step 2");
  refused("", "--at 1 2 3");
  for (const char* option : {"--step 2", "--at 1 2 3", "--frontiers", "--poses original"})
    refused("a/camera.yaml", option);
}

/// A hall of free space in the unknown, 0 to 8 m by 0 to 4 m by 0 to 2 m in voxels of 0.5 m, with a wall of
/// one voxel at x = 5 m that leaves a door at y = 1 to 2 m, and a room apart from it, one voxel large.
class InfoOfAMap : public testing::Test {
 protected:
  static constexpr double kVoxel = 0.5;
  static constexpr int kX = 16, kY = 8, kZ = 4, kWall = 10;
  static bool is_wall(int x, int y) { return x == kWall && (y < 2 || y > 3); }

  void SetUp() override {
    auto tree = std::make_unique<octomap::OcTree>(kVoxel);
    const auto put = [&tree](int x, int y, int z, float log_odds) {
      tree->setNodeValue(kVoxel * (x + 0.5), kVoxel * (y + 0.5), kVoxel * (z + 0.5), log_odds);
    };
    for (int x = 0; x < kX; ++x)
      for (int y = 0; y < kY; ++y)
        for (int z = 0; z < kZ; ++z) put(x, y, z, is_wall(x, y) ? 2.0F : -1.0F);
    put(40, 0, 0, -1.0F);
    const auto map = mapping::OccupancyMap::create({}, std::move(tree));
    ASSERT_TRUE(map.ok()) << map.error().message;
    const Status written = io::write_map(*map, file(), io::Overwrite::refuse);
    ASSERT_TRUE(written.ok()) << written.error().message;
  }
  [[nodiscard]] fs::path file() const { return folder_ / "hall.ot"; }
  [[nodiscard]] Outcome info(const std::string& options) const {
    return shell(kPade + " info " + file().string() + " " + options);
  }
  [[nodiscard]] nlohmann::json answer(const std::string& options) const {
    const Outcome outcome = info(options + " --json");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    return nlohmann::json::parse(outcome.text);
  }
  /// Voxels that a test takes: of each kind.
  struct Kinds {
    int occupied = 0, free = 0, unknown = 0;
  };
  template <class Takes>
  static Kinds count(const Takes& takes) {
    Kinds kinds;
    for (int x = -20; x < 30; ++x) {
      for (int y = -20; y < 30; ++y) {
        for (int z = -20; z < 30; ++z) {
          if (!takes(x, y, z)) continue;
          const bool known = x >= 0 && x < kX && y >= 0 && y < kY && z >= 0 && z < kZ;
          ++(!known ? kinds.unknown : is_wall(x, y) ? kinds.occupied : kinds.free);
        }
      }
    }
    return kinds;
  }
  static void expect_kinds(const nlohmann::json& json, const Kinds& kinds) {
    EXPECT_EQ(json.at("occupied_voxels"), kinds.occupied) << json;
    EXPECT_EQ(json.at("free_voxels"), kinds.free) << json;
    EXPECT_EQ(json.at("unknown_voxels"), kinds.unknown) << json;
    EXPECT_NEAR(json.at("highest_probability"), 1 / (1 + std::exp(kinds.occupied > 0 ? -2.0 : 1.0)), 0.005);
  }
  test::TemporaryFolder folder_;
};

TEST_F(InfoOfAMap, SaysWhatARayMeets) {
  const auto wall = answer("--ray 1.2 0.3 1.1 2 0 0").at("ray");
  EXPECT_NEAR(wall.at("hit").at("length_m"), 5 - 1.2, 1e-9);
  EXPECT_EQ(wall.at("hit").at("state"), "occupied");
  EXPECT_EQ(wall.at("hit").at("voxel_m"), nlohmann::json({5.25, 0.25, 1.25}));
  // Through the door to the end of the hall, and on.
  EXPECT_TRUE(answer("--ray 1.2 1.3 1.1 1 0 0 --reach 6.7").at("ray").at("hit").is_null());
  const auto end = answer("--ray 1.2 1.3 1.1 1e-300 0 0 --reach 6.9").at("ray").at("hit");
  EXPECT_NEAR(end.at("length_m"), 8 - 1.2, 1e-9);
  EXPECT_EQ(end.at("state"), "unknown");
  EXPECT_TRUE(answer("--ray 1.2 1.3 1.1 1 0 0 --unknown free").at("ray").at("hit").is_null());
  EXPECT_THAT(info("--ray 1.2 0.3 1.1 2 0 0").text,
              HasSubstr("occupied voxel at (5.25, 0.25, 1.25) after 3.80 m"));
  EXPECT_THAT(info("--ray 1.2,1.3,1.1,1,0,0 --reach 3").text, HasSubstr("nothing blocks it"));
}

TEST_F(InfoOfAMap, CountsWhatABoxAndABallHold) {
  expect_kinds(answer("--box 4.2 -0.7 0.2 5.3 1.8 1.9").at("box"), count([](int x, int y, int z) {
                 return x >= 8 && x <= 10 && y >= -2 && y <= 3 && z >= 0 && z <= 3;
               }));
  // Two other corners of the same box.
  EXPECT_EQ(answer("--box 5.3 -0.7 1.9 4.2 1.8 0.2").at("box"),
            answer("--box 4.2 -0.7 0.2 5.3 1.8 1.9").at("box"));
  const auto outside = [](double at, int voxel) {
    return std::max({kVoxel * voxel - at, at - kVoxel * (voxel + 1), 0.0});
  };
  expect_kinds(answer("--ball 4.1 0.4 1.1 1.3").at("ball"), count([&](int x, int y, int z) {
                 return std::hypot(outside(4.1, x), outside(0.4, y), outside(1.1, z)) < 1.3;
               }));
  expect_kinds(answer("--ball 2.1 2.1 1.1 0.3").at("ball"), count([&](int x, int y, int z) {
                 return std::hypot(outside(2.1, x), outside(2.1, y), outside(1.1, z)) < 0.3;
               }));
  EXPECT_THAT(info("--ball 2.1 2.1 1.1 0.3").text, HasSubstr("0 occupied, 8 free, 0 unknown voxels"));
}

TEST_F(InfoOfAMap, SaysWhatASweptBallMeets) {
  // Along the wall's side of the hall, then towards it: 0.4 m before its face.
  const auto wall = answer("--sweep 1 1.5 1 3 1.5 1 3 3.1 1 7 3.1 1 --radius 0.4").at("sweep");
  EXPECT_NEAR(wall.at("length_m"), 2 + 1.6 + 4, 1e-9);
  const auto& hit = wall.at("hit");
  EXPECT_NEAR(hit.at("length_m"), 2 + 1.6 + 1.6, 1e-9);
  EXPECT_EQ(hit.at("segment"), 2);
  EXPECT_NEAR(hit.at("share"), 0.4, 1e-9);
  EXPECT_EQ(hit.at("state"), "occupied");
  EXPECT_NEAR(hit.at("place_m").at(0), 4.6, 1e-9);
  EXPECT_EQ(hit.at("voxel_m").at(0), 5.25);
  // Through the door, which is 1 m wide.
  EXPECT_TRUE(answer("--sweep 1 1.5 1 7 1.5 1").at("sweep").at("hit").is_null());
  EXPECT_EQ(answer("--sweep 1 1.5 1 7 1.5 1 --radius 0.55").at("sweep").at("hit").at("state"), "occupied");
  // Out of the hall.
  const auto out = answer("--sweep 1 1.5 1 11 1.5 1 --radius 0.3").at("sweep").at("hit");
  EXPECT_EQ(out.at("state"), "unknown");
  EXPECT_NEAR(out.at("length_m"), 8 - 1 - 0.3, 1e-9);
  EXPECT_TRUE(answer("--sweep 1 1.5 1 11 1.5 1 --unknown free").at("sweep").at("hit").is_null());
  EXPECT_THAT(info("--sweep 1 1.5 1 3 1.5 1 3 3.1 1 7 3.1 1 --radius 0.4").text,
              testing::AllOf(HasSubstr("meets the occupied voxel at (5.25, "), HasSubstr(" after 5.20 m")));
}

TEST_F(InfoOfAMap, NamesItsFrontiers) {
  int rim = 0;
  for (int x = 0; x < kX; ++x)
    for (int y = 0; y < kY; ++y)
      for (int z = 0; z < kZ; ++z)
        if (!is_wall(x, y) && (x % (kX - 1) == 0 || y % (kY - 1) == 0 || z % (kZ - 1) == 0)) ++rim;
  const auto all = answer("--frontiers").at("frontiers");
  EXPECT_EQ(all.at("voxels"), rim + 1);
  EXPECT_EQ(all.at("groups"), 2);
  EXPECT_EQ(all.at("largest").at(0).at("voxels"), rim);
  EXPECT_EQ(all.at("largest").at(0).at("from_m"), nlohmann::json({0.0, 0.0, 0.0}));
  EXPECT_EQ(all.at("largest").at(0).at("to_m"), nlohmann::json({8.0, 4.0, 2.0}));
  EXPECT_EQ(all.at("largest").at(1).at("centre_m"), nlohmann::json({20.25, 0.25, 0.25}));
  const auto part = answer("--frontiers --box 19 -1 -1 21 1 1");
  EXPECT_EQ(part.at("frontiers").at("voxels"), 1);
  EXPECT_EQ(part.at("box").at("free_voxels"), 1);
  EXPECT_THAT(info("--frontiers").text, HasSubstr(fmt::format("{} free voxels beside unknown ones, in 2 "
                                                              "groups",
                                                              rim + 1)));
}

TEST_F(InfoOfAMap, SaysWhatLiesAroundAPlace) {
  const auto place = answer("--at 2.1 1.2 1.1").at("place");
  EXPECT_EQ(place.at("state"), "free");
  EXPECT_EQ(place.at("sectors_reach_m"), 20);
  const auto& sectors = place.at("sectors_m");
  ASSERT_EQ(sectors.size(), 72U);
  EXPECT_NEAR(sectors.at(71), std::hypot(2.9, 0.2), 1e-9);  // the corner of the wall beside the door
  EXPECT_TRUE(sectors.at(36).is_null());                    // behind it
  EXPECT_TRUE(answer("--at 2.1 1.2 1.1 --reach 2.8").at("place").at("sectors_m").at(71).is_null());
  EXPECT_THAT(info("--at 2.1 1.2 1.1 --reach 7").text,
              testing::AllOf(HasSubstr("up to 7 m away"), testing::ContainsRegex("180 deg( +-){12}\n")));
}

TEST_F(InfoOfAMap, RefusesNumbersThatMakeNoSense) {
  const auto refused = [&](const std::string& options, const std::string& why) {
    const Outcome outcome = info(options);
    EXPECT_NE(outcome.code, 0) << options;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr(options.substr(0, options.find(' '))), HasSubstr(why)))
        << options;
  };
  refused("--at 0 nan 0", "expected finite numbers");
  refused("--ray 0 0 inf 1 0 0", "expected finite numbers");
  refused("--ray 0 0 0 0 0 0", "expected one that leads somewhere");
  refused("--ray 0 0 0 1 0", "");
  refused("--reach 0 --ray 0 0 0 1 0 0", "expected above 0");
  refused("--reach nan --ray 0 0 0 1 0 0", "expected above 0");
  refused("--ball 1 1 1 0", "expected above 0");
  refused("--ball 1 1 1 -2", "expected above 0");
  refused("--ball 1 1 1", "");
  refused("--ball 1 1 1 1e6", "voxels to look at");
  refused("--box 0 0 0 1 1", "");
  refused("--box -9000 -9000 -9000 9000 9000 9000", "voxels to look at");
  refused("--sweep 1 1 1", "");
  refused("--sweep 1 1 1 2 2 2 3", "expected x y z of two points or more");
  refused("--sweep 1 1 1 2 2 1e9", "can hold");
  refused("--radius 0 --sweep 1 1 1 2 1 1", "expected 0.01 to 10");
  refused("--radius nan --sweep 1 1 1 2 1 1", "expected 0.01 to 10");
  refused("--unknown maybe --sweep 1 1 1 2 1 1", "blocked");
  refused("--radius 1 --box 0 0 0 1 1 1", "it would do nothing");
  refused("--reach 1 --sweep 1 1 1 2 1 1", "it would do nothing");
  refused("--unknown free --at 1 1 1", "it would do nothing");
  refused("--step 2 --at 1 1 1", "it would do nothing");
}

}  // namespace
}  // namespace pade
