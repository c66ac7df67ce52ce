// The worlds that poses and maps are in: their borders, their names, and poses that change from one to the
// other.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge.hpp"
#include "ros/bridge_bed.hpp"

namespace pade_ros {
namespace {

using ::testing::HasSubstr;

class RosWorlds : public RosBridge {
 protected:
  /// What is published at last, once so many frames are mapped.
  MapResult published(const std::string& mapped) {
    EXPECT_TRUE(counts("mapped", mapped)) << value("camera", "mapped");
    MapResult now;
    EXPECT_TRUE(bridge_->map_now({false, false, true, false, true, true}, now));
    return now;
  }
  void fly_from(double x, int from, int to) {
    for (int k = from; k < to; ++k) {
      place_at(k, {x + 0.05 * k, 0, 0});
      show(k);
    }
  }
};

TEST_F(RosWorlds, FarFromTheOriginOfThePosesTheMapHasOneOfItsOwn) {
  for (const double far : {3400.0, 500'000.0}) {
    start();
    calibrate();
    fly_from(far, 0, 8);
    const MapResult map = published("8");
    EXPECT_GT(map.occupied.size(), 50U) << far;
    EXPECT_EQ(map.world_frame, "pade_map");
    EXPECT_EQ(value("mapper", "outside"), "0");
    EXPECT_EQ(value("mapper", "begun_anew"), "0") << "nothing was lost";
    const std::lock_guard lock(sink_.mutex);
    EXPECT_EQ(sink_.last.world_frame, "pade_map");
    EXPECT_EQ(sink_.last.poses_frame, "odom");
    EXPECT_EQ(sink_.last.origin[0], far);
    EXPECT_NEAR(sink_.path.back().T_world_camera.position[0], 0.35, 1e-6);
    for (const auto& voxel : map.occupied) EXPECT_LT(std::abs(voxel[0]), 3);
    ASSERT_FALSE(sink_.last.cloud.empty());
    for (const CloudPoint& point : sink_.last.cloud) ASSERT_LT(std::abs(point.x), 3);
    EXPECT_TRUE(std::any_of(sink_.said.begin(), sink_.said.end(), [](const std::string& text) {
      return text.find("of that of the poses (odom): its frame is pade_map") != std::string::npos;
    }));
  }
}

TEST_F(RosWorlds, NearTheBorderAnotherMapIsBegun) {
  start();
  calibrate();
  // The border is 3276.8 m away, and 200 m before it the map is begun anew: between the fourth and the fifth.
  fly_from(3076.8 - 0.17, 0, 10);
  const MapResult map = published("10");
  EXPECT_EQ(value("mapper", "begun_anew"), "1");
  EXPECT_EQ(value("mapper", "last_begun_anew"), "the camera came near the border of what a map can hold");
  EXPECT_EQ(map.world_frame, "pade_map");
  EXPECT_GT(map.occupied.size(), 50U);
}

TEST_F(RosWorlds, PosesThatJumpInASilenceBeginTheMapAnew) {
  for (const double silence : {0.6, 5.0}) {
    start();
    calibrate();
    fly(0, 6);
    ASSERT_TRUE(counts("mapped", "6"));
    const int after = 5 + static_cast<int>(std::lround(silence * 10));
    for (int i = 0; i < 6; ++i) {
      place_at(after + i, {0.05 * i, 5, 0});
      show(after + i, 50 + i);
    }
    const MapResult map = published("12");
    EXPECT_EQ(value("mapper", "begun_anew"), "1") << silence;
    EXPECT_GT(map.occupied.size(), 50U);
    for (const auto& voxel : map.occupied) ASSERT_GT(voxel[1], 3) << "of the world before";
  }
}

TEST_F(RosWorlds, AHeadingThatIsSetAnewBeginsTheMapAnew) {
  start();
  calibrate();
  fly(0, 6);
  ASSERT_TRUE(counts("mapped", "6"));
  for (int k = 6; k < 12; ++k) {
    place_at(k, {0.05 * k, 0, 0}, 40 * M_PI / 180);
    show(k);
  }
  ASSERT_TRUE(counts("mapped", "12"));
  EXPECT_EQ(value("mapper", "last_begun_anew"), "the poses turned by 40 degrees at once");
  EXPECT_EQ(value("mapper", "begun_anew"), "1");
}

TEST_F(RosWorlds, TransformsThatJumpBeginTheMapAnew) {
  const auto fly_at = [&](const char* jumps, double aside, int pause) {
    start({{"poses", "tf"}});
    transforms_.others[{"map", "camera"}] = [aside, pause](Stamp stamp) {
      const double k = static_cast<double>(stamp - kStart) / static_cast<double>(kPeriod);
      return Placement{{0.05 * k, k > 5.5 + pause ? aside : 0, 0}, {0, 0, 0, 1}};
    };
    calibrate();
    for (int k = 0; k < 12; ++k) show(k < 6 ? k : k + pause);
    const MapResult map = published("12");
    EXPECT_EQ(value("mapper", "begun_anew"), jumps) << aside << " " << pause;
    EXPECT_EQ(value("poses", "jumps"), jumps);
    for (const auto& voxel : map.occupied) ASSERT_GT(voxel[1], aside > 0 ? 3 : -3) << "of the world before";
  };
  fly_at("1", 5, 0);
  fly_at("1", 5, 30);
  fly_at("0", 0, 30);  // it is the camera that paused
}

TEST_F(RosWorlds, PosesThatNameNoFrameAreMapped) {
  start({{"poses", "pose"}, {"base_frame", "camera"}});
  calibrate();
  for (int k = 0; k < 8; ++k) {
    place_at(k, {0.05 * k, 0, 0}, 0, "");
    show(k);
  }
  ASSERT_TRUE(counts("mapped", "8"));
  ASSERT_TRUE(comes([&] {
    const std::lock_guard lock(sink_.mutex);
    return !sink_.newest.occupied.empty();
  }));
  const std::lock_guard lock(sink_.mutex);
  EXPECT_EQ(sink_.newest.world_frame, "map");
}

TEST_F(RosWorlds, WhatTheMapForgetsIsNotPublishedAsFree) {
  start({{"mapper.map.forget_after", "1"}});
  calibrate();
  fly(0, 8);
  ASSERT_TRUE(counts("mapped", "8"));
  MapResult before;
  ASSERT_TRUE(bridge_->map_now({false, false, true, false, false, false}, before));
  for (int k = 8; k < 30; ++k) {  // hangs: nothing can be mapped
    place_at(k, {0.05 * 7, 0, 0});
    show(k, 7);
  }
  ASSERT_TRUE(comes([&] { return value("camera", "mapped") == "30" || value("camera", "skipped") == "22"; }))
      << value("camera", "mapped") << " " << value("camera", "skipped");
  MapResult now;
  ASSERT_TRUE(bridge_->map_now({false, false, true, false, false, false}, now));
  const auto file = std::filesystem::temp_directory_path() /
                    ("pade-ros-forget-" +
                     std::to_string(std::chrono::steady_clock::now().time_since_epoch().count()) + ".bt");
  std::string said;
  ASSERT_TRUE(bridge_->save_map(file.string(), said)) << said;
  std::ifstream in(file, std::ios::binary);
  const std::string written((std::istreambuf_iterator<char>(in)), {});
  EXPECT_TRUE(written.ends_with(std::string(now.binary.begin(), now.binary.end())));
  EXPECT_NE(now.binary, before.binary) << "nothing was forgotten, so nothing is tested";
  std::filesystem::remove(file);
  std::filesystem::remove(std::filesystem::path(file).replace_extension(".json"));
}

/// Whatever the mapper's windows and order, cloud and depth are on the camera's pixels, where the wall is.
TEST_F(RosWorlds, CloudAndDepthFitTheImageOfTheirStamp) {
  for (const char* const window : {"1", "4"}) {
    for (const char* const order : {"newest", "first"}) {
      start({{"mapper.depth.window", window},
             {"mapper.order", order},
             {"mapper.step", "1"},
             {"mapper.longest_step", "1"},
             {"cloud_step", "1"}});
      calibrate();
      fly(0, 8);
      ASSERT_TRUE(counts("mapped", "8"));
      const std::lock_guard lock(sink_.mutex);
      const FrameResult& last = sink_.last;
      EXPECT_EQ(last.width, kWidth) << window << order;
      EXPECT_EQ(last.height, kHeight);
      EXPECT_EQ(last.sigma.size(), static_cast<std::size_t>(kWidth * kHeight));
      const int k = std::string(order) == "newest" ? 7 : 6;
      EXPECT_EQ(last.stamp, stamp(k)) << window << order;
      EXPECT_EQ(last.pose_stamp, stamp(7));
      ASSERT_GT(last.cloud.size(), 200U);
      const cv::Mat all = wall();
      double left = 1e9, right = -1e9;
      std::size_t wrong = 0;
      for (const CloudPoint& point : last.cloud) {
        left = std::min<double>(left, point.x);
        right = std::max<double>(right, point.x);
        // Its colour is that of its pixel in the image of the stamp.
        const int u = static_cast<int>(std::lround(kFocal * (point.x - 0.05 * k) / point.z + 79.5));
        const int v = static_cast<int>(std::lround(kFocal * point.y / point.z + 59.5));
        if (u < 0 || v < 0 || u >= kWidth || v >= kHeight) {
          ++wrong;
          continue;
        }
        const int off = std::abs(all.at<std::uint8_t>(v, 4 * k + u) - point.g);
        wrong += std::string(window) == "1" && off > 0 ? 1 : 0;
      }
      EXPECT_EQ(wrong, 0U) << window << order << " of " << last.cloud.size();
      EXPECT_GT(right - left, 1.2) << "as wide as the view, " << window << order;
    }
  }
}

ImuMessage imu_at(Stamp stamp, double ahead = 0) {
  ImuMessage message;
  message.stamp = stamp;
  message.frame = "imu_link";
  message.specific_force = {ahead, 0, 9.81};
  return message;
}

FixMessage fix_at(Stamp stamp, double east = 0) {
  FixMessage message;
  message.stamp = stamp;
  message.frame = "gps";
  message.longitude = east / 111'319.49079;
  message.covariance_kind = 2;
  message.covariance = {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
  return message;
}

TEST_F(RosWorlds, TheAntennasPlaceIsWaitedForAndItsLackIsSaid) {
  const auto come = [&](double fix_before, double transform_after) {
    start({{"poses", "sensors"}});
    {
      const std::lock_guard lock(transforms_.mutex);
      transforms_.others.clear();
    }
    if (fix_before > 0) bridge_->add(fix_at(kStart - static_cast<Stamp>(fix_before * 1e9)));
    for (int i = 0; i < 1000; ++i) {
      if (i * 0.01 >= transform_after) transforms_.set("imu_link", "gps", {{-0.5, 0, 0.2}, {0, 0, 0, 1}});
      bridge_->add(imu_at(kStart + i * 10'000'000LL));
      if (i % 20 == 5) bridge_->add(fix_at(kStart + i * 10'000'000LL));
    }
  };
  for (const double fix_before : {0.0, 0.1}) {
    for (const double transform_after : {0.0, 2.0}) {
      come(fix_before, transform_after);
      EXPECT_EQ(value("poses", "lever_arm"), "-0.500 0.000 0.200") << fix_before << " " << transform_after;
      EXPECT_EQ(value("poses", "antenna"), "");
      EXPECT_EQ(value("poses", "status"), "levelled") << "held fixes and samples were taken";
    }
  }
  come(0, 100);
  EXPECT_EQ(value("poses", "lever_arm"), "0.000 0.000 0.000");
  EXPECT_THAT(value("poses", "antenna"), HasSubstr("the antenna is taken to be at the IMU: no transform"));
}

TEST_F(RosWorlds, TheTransformIsThatOfTheVehicleWhereverTheImuSits) {
  start({{"poses", "sensors"}, {"navigator.history", "60"}, {"max_wait_for_pose", "5"}});
  transforms_.set("imu_link", "camera", {{0.1, 0, 0}, {-0.5, 0.5, -0.5, 0.5}});
  transforms_.set("imu_link", "gps", {{0, 0, 0}, {0, 0, 0, 1}});
  calibrate();
  // It flies east, and its IMU looks back: half a turn about the vertical.
  constexpr double kStep = 0.005;
  double speed = 0, x = 0;
  const auto fly_on = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const double t = i * kStep;
      const double speeding = t >= 3 && t < 6 ? 1 : 0;
      const Stamp now = kStart + static_cast<Stamp>(t * 1e9);
      bridge_->add(imu_at(now, -speeding));
      speed += speeding * kStep;
      x += speed * kStep;
      if (i % 20 == 0) {
        FieldMessage field;
        field.stamp = now;
        field.frame = "imu_link";
        field.tesla = {0, -2e-5, -4e-5};
        bridge_->add(field);
      }
      if (i % 40 == 0) {
        bridge_->add(fix_at(now, x));
        bridge_->add(VelocityMessage{now, {speed, 0, 1e-4}, {0.01, 0.01, 0.01}});
      }
    }
  };
  fly_on(0, 3000);
  const int image = static_cast<int>(2990 * kStep * 10);
  for (int k = image - 3; k < image; ++k) show(k);
  ASSERT_TRUE(counts("mapped", "3")) << value("camera", "skipped") << message("poses");
  {
    const std::lock_guard lock(sink_.mutex);
    EXPECT_EQ(sink_.last.body_frame, "");
  }
  EXPECT_THAT(value("poses", "transform"), HasSubstr("it is not known how base_link sits on imu_link"));
  transforms_.set("imu_link", "base_link", {{0.3, 0, 0}, {0, 0, 1, 0}});
  for (int k = image - 3 + 3; k < image + 1; ++k) show(k);
  fly_on(3000, 3200);
  ASSERT_TRUE(counts("mapped", "4")) << value("camera", "skipped");
  const std::lock_guard lock(sink_.mutex);
  EXPECT_EQ(sink_.last.body_frame, "base_link");
  const Placement& body = sink_.last.T_world_body;
  EXPECT_GT(std::abs(body.xyzw[3]), 0.99) << "it looks east, whatever its IMU does";
  // The IMU lies 0.3 m ahead... of the vehicle, since base_link is 0.3 m ahead of an IMU that looks back.
  EXPECT_NEAR(body.position[1], 0, 0.5);
}

TEST(RosParameters, OfWhichTheNodeMakesTextKeepAllTheirDigits) {
  for (const double number : {4.4e-07, 1.0 / 3, 123456789.123, -0.02, 1e300}) {
    EXPECT_EQ(std::stod(text_of(number)), number) << text_of(number);
  }
  Settings settings;
  std::string error;
  EXPECT_TRUE(read_settings({{"navigator.filter.gyroscope_bias_walk", text_of(4.4e-07)},
                             {"occupancy_max_z", text_of(std::numeric_limits<double>::infinity())}},
                            settings, error))
      << error;
}

}  // namespace
}  // namespace pade_ros
