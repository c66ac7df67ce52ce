// The nodes of ROS without ROS: a camera slides along a textured wall, and messages come, come late, or do
// not come.
#include "bridge.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/pade.hpp"

#include "ros/bridge_bed.hpp"

namespace pade_ros {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(RosBridge, FramesAndPosesMakeTheMapThatTheMapperMakes) {
  start();
  calibrate();
  fly(0, 8);
  ASSERT_TRUE(counts("mapped", "8")) << value("camera", "mapped");
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() /
      ("pade-ros-" + std::to_string(std::chrono::steady_clock::now().time_since_epoch().count()) + ".bt");
  std::string said;
  ASSERT_TRUE(bridge_->save_map(file.string(), said)) << said;

  pade::ObstacleMapperOptions options;
  options.views.count = 0;
  const pade::Camera camera{
      .width = kWidth, .height = kHeight, .fx = kFocal, .fy = kFocal, .cx = 79.5, .cy = 59.5};
  auto mapper = pade::ObstacleMapper::create(camera, options);
  ASSERT_TRUE(mapper);
  const cv::Mat all = wall();
  for (int k = 0; k < 8; ++k) {
    pade::Pose pose;
    pose.translation.x() = 0.05 * k;
    mapper->add(all(cv::Rect(4 * k, 0, kWidth, kHeight)), {stamp(k)}, pose);
  }
  const std::string expected =
      pade::io::bytes_of(pade::io::encode_map(mapper->map(), pade::io::MapFormat::bt));
  std::ifstream in(said, std::ios::binary);
  const std::string written((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(written, expected);
  EXPECT_GT(mapper->map().counts().occupied, 50U);
  EXPECT_TRUE(bridge_->save_map(file.string(), said));
  EXPECT_THAT(said, HasSubstr("-1.bt")) << "no map is written over";
  std::filesystem::remove(said);
  std::filesystem::remove(file);
  std::filesystem::remove(pade::io::side_car_of(file));
  std::filesystem::remove(pade::io::side_car_of(said));

  // What is published says the same.
  MapResult now;
  ASSERT_TRUE(bridge_->map_now({false, false, true, false, true, true}, now));
  EXPECT_TRUE(expected.ends_with(std::string(now.binary.begin(), now.binary.end())));
  EXPECT_EQ(now.occupied.size(), mapper->map().counts().occupied);
  for (const auto& c : now.occupied) {
    EXPECT_EQ(
        mapper->map().at({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])}),
        pade::mapping::Occupancy::occupied);
  }
  std::set<std::pair<int, int>> columns;
  for (const auto& c : now.occupied)
    columns.insert({static_cast<int>(std::floor((static_cast<double>(c[0]) - now.left) / now.voxel)),
                    static_cast<int>(std::floor((static_cast<double>(c[1]) - now.bottom) / now.voxel))});
  EXPECT_EQ(static_cast<std::size_t>(std::count(now.cells.begin(), now.cells.end(), 100)), columns.size());
  for (const auto& [x, y] : columns) EXPECT_EQ(now.cells[static_cast<std::size_t>(y * now.columns + x)], 100);

  const std::lock_guard lock(sink_.mutex);
  EXPECT_EQ(sink_.frames, 7);
  EXPECT_NEAR(static_cast<double>(sink_.middle), kDistance, 0.1);
  EXPECT_EQ(sink_.last.world_frame, "odom");
  ASSERT_FALSE(sink_.last.cloud.empty());
  std::vector<float> z;
  for (const CloudPoint& point : sink_.last.cloud) z.push_back(point.z);
  std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2), z.end());
  EXPECT_NEAR(static_cast<double>(z[z.size() / 2]), kDistance, 0.05);
}

TEST_F(RosBridge, WhatIsMissingIsNamed) {
  start();
  EXPECT_EQ(message("camera"), "no image on /image");
  EXPECT_EQ(message("camera_info"), "no sensor_msgs/CameraInfo on /camera_info");
  EXPECT_EQ(message("poses"), "no nav_msgs/Odometry on /odom");
  show(0);
  EXPECT_TRUE(counts("skipped: no camera_info has come on /camera_info", "1"));
  calibrate();
  show(1);
  EXPECT_TRUE(counts("skipped: no pose has come", "1"));
  std::string said;
  EXPECT_FALSE(bridge_->save_map("/tmp/never.bt", said));
  EXPECT_EQ(said, "nothing is mapped yet: no file was written");
  calibrate(640, 480);
  place(2);
  show(2);
  EXPECT_TRUE(counts("skipped: the images have 160 x 120 pixels, and camera_info is for 640 x 480", "1"));
  calibrate();
  place(3);
  show(3, "nonsense");
  EXPECT_TRUE(comes([&] { return value("camera", "skipped") == "4"; }));
  const std::lock_guard lock(sink_.mutex);
  EXPECT_TRUE(std::any_of(sink_.said.begin(), sink_.said.end(), [](const std::string& text) {
    return text.find("found the encoding \"nonsense\"") != std::string::npos;
  })) << ::testing::PrintToString(sink_.said);
}

TEST_F(RosBridge, AFrameWaitsForItsPoseAndIsNeverMappedWithAnother) {
  start({{"max_wait_for_pose", "30"}});
  calibrate();
  show(0);
  place(-0.5);
  EXPECT_EQ(value("camera", "mapped"), "0");
  place(0.5);  // behind it: now it lies between two
  ASSERT_TRUE(counts("mapped", "1"));
  place(2.5);
  place(5.5);  // more than 0.25 s later: nothing is made up in between
  show(4);
  ASSERT_TRUE(counts("skipped: a gap in the poses", "1"));
  EXPECT_EQ(value("camera", "mapped"), "1");
}

TEST_F(RosBridge, TimeThatGoesBackBeginsTheMapAnewOnce) {
  start();
  calibrate();
  fly(20, 24);
  ASSERT_TRUE(counts("mapped", "4"));
  fly(0, 4);
  ASSERT_TRUE(counts("mapped", "8")) << value("camera", "skipped");
  EXPECT_EQ(value("mapper", "begun_anew"), "1");
  EXPECT_EQ(value("mapper", "last_begun_anew"), "the time went back by 2.3 s");
  EXPECT_EQ(transforms_.cleared, 1);
}

TEST_F(RosBridge, PosesThatJumpBeginTheMapAnew) {
  start();
  calibrate();
  fly(0, 4);
  ASSERT_TRUE(counts("mapped", "4"));
  PoseMessage message;
  message.frame = "odom";
  message.child = "camera";
  message.stamp = stamp(4);
  message.pose.position = {0.2 + 5, 0, 0};
  bridge_->add(message);
  show(4);
  ASSERT_TRUE(counts("mapped", "5"));
  EXPECT_EQ(value("mapper", "begun_anew"), "1");
  EXPECT_EQ(value("mapper", "last_begun_anew"), "the poses jumped by 5.00 m");
}

TEST_F(RosBridge, ResetEmptiesTheMapForWhoListens) {
  start();
  calibrate();
  fly(0, 5);
  ASSERT_TRUE(comes([&] {
    const std::lock_guard lock(sink_.mutex);
    return !sink_.newest.occupied.empty();
  }));
  ASSERT_TRUE(counts("mapped", "5"));
  bridge_->reset();
  EXPECT_TRUE(comes([&] {
    const std::lock_guard lock(sink_.mutex);
    return sink_.newest.occupied.empty() && sink_.newest.binary.empty();
  }));
  MapResult now;
  EXPECT_FALSE(bridge_->map_now({}, now));
  EXPECT_EQ(value("mapper", "last_begun_anew"), "asked for by reset");
}

TEST_F(RosBridge, TheMountingComesFromTransformsOrFromAParameter) {
  start({{"max_wait_for_pose", "30"}});
  calibrate();
  show(0);
  place(0, "base_link");
  EXPECT_EQ(value("camera", "mapped"), "0");
  transforms_.known = Placement{{0.1, 0, 0}, {0.5, -0.5, 0.5, -0.5}};
  EXPECT_TRUE(counts("mapped", "1"));

  start({{"mounting", "0.1 0 0 0.5 -0.5 0.5 -0.5"}});
  transforms_.known.reset();
  calibrate();
  place(0, "somewhere");
  show(0);
  EXPECT_TRUE(counts("mapped", "1"));
}

TEST_F(RosBridge, OurFilterSaysWhatItLacks) {
  start({{"poses", "sensors"}});
  EXPECT_EQ(message("poses"), "no sensor_msgs/Imu on /imu");
  for (int i = 0; i < 50; ++i) {
    ImuMessage imu;
    imu.stamp = kStart + i * 10'000'000;
    imu.frame = "imu";
    imu.specific_force = {0, 0, 9.81};
    bridge_->add(imu);
  }
  EXPECT_EQ(message("poses"), "no sensor_msgs/NavSatFix on /fix");
  FixMessage fix;
  fix.stamp = kStart;
  fix.status = -1;
  bridge_->add(fix);
  EXPECT_EQ(message("poses"), "/fix has no fix");
}

TEST_F(RosBridge, AQueueThatIsFullDropsAndCounts) {
  start({{"max_latency", "10"}, {"max_wait_for_pose", "30"}, {"most_waiting", "3"}});
  calibrate();
  for (int k = 0; k < 7; ++k) show(k);
  EXPECT_EQ(value("camera", "dropped"), "4");
  for (int k = 0; k < 7; ++k) place(k);
  EXPECT_TRUE(counts("mapped", "3")) << "the oldest and the newest two";
}

TEST(RosParameters, AreRefusedByName) {
  NoTransforms transforms;
  Kept sink;
  const auto error_of = [&](const Parameters& parameters) {
    std::string error;
    EXPECT_EQ(Bridge::create(parameters, {}, sink, transforms, error), nullptr);
    return error;
  };
  EXPECT_THAT(error_of({{"mapper.map.voxle", "0.2"}}), HasSubstr("voxle"));
  EXPECT_THAT(error_of({{"mapper.map.voxel", "-1"}}), HasSubstr("voxel"));
  EXPECT_THAT(error_of({{"poses", "gps"}}), HasSubstr("odometry"));
  EXPECT_THAT(error_of({{"map_rate", "0"}}), HasSubstr("map_rate"));
  EXPECT_THAT(error_of({{"mounting", "1 2 3"}}), HasSubstr("mounting"));
  EXPECT_THAT(error_of({{"map_file", "map.ply"}}), HasSubstr("map_file"));
  Settings settings;
  std::string error;
  ASSERT_TRUE(read_settings({{"mapper.map.voxel", "0.2"}, {"poses", "tf"}, {"occupancy_max_z", ".inf"}},
                            settings, error))
      << error;
  EXPECT_EQ(settings.poses, "tf");
}

}  // namespace
}  // namespace pade_ros
