// Recordings written and read back, damaged, cut off, and those that others made.
#include "pade/io/recording/recording.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#ifdef PADE_HAS_SQLITE
#include <sqlite3.h>
#endif

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/recorded_images.hpp"
#include "pade/io/recording/messages/message_writer.hpp"

#include "io/recording/own_recording.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;
using test::opened_flight;
using test::OwnRecording;
using test::record;
using test::some_sensors;

void expect_same_flight(const Sequence& a, const Sequence& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.raw_camera(), b.raw_camera());
  EXPECT_TRUE(test::same_pixels(a.mask(), b.mask()));
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.time(i), b.time(i));
    EXPECT_EQ(a.pose(i).translation, b.pose(i).translation);
    EXPECT_EQ(a.pose(i).rotation.coeffs(), b.pose(i).rotation.coeffs());
    const auto frame_a = a.frame(i), frame_b = b.frame(i);
    ASSERT_TRUE(frame_a);
    ASSERT_TRUE(frame_b) << frame_b.error().message;
    EXPECT_TRUE(test::same_pixels(frame_a->image, frame_b->image));
  }
}

TEST(RecordedFlight, IsTheSameInEveryFormat) {
  const test::TemporaryFolder folder;
  const Sequence original = opened_flight(folder / "flight", test::make_flight());
  for (const char* const name : {"flight.bag", "flight.mcap"}) {
    record(original, folder / name);
    const auto read = Sequence::open(folder / name);
    ASSERT_TRUE(read) << read.error().message;
    expect_same_flight(original, *read);
    EXPECT_EQ(read->pose_file(), "odom");
  }
  // And from a recording into a folder and the other format.
  const auto bag = Sequence::open(folder / "flight.bag");
  record(*bag, folder / "again.mcap");
  auto out = OutputFolder::create(folder / "again", Overwrite::refuse, "camera.yaml");
  ASSERT_TRUE(out);
  ASSERT_TRUE(write_flight(*bag, nullptr, *out));
  ASSERT_TRUE(out->commit());
  for (const char* const name : {"again", "again.mcap"}) {
    const auto read = Sequence::open(folder / name);
    ASSERT_TRUE(read) << read.error().message;
    expect_same_flight(original, *read);
  }
}

TEST(RecordedFlight, KeepsTheMountingOfTheCamera) {
  const test::TemporaryFolder folder;
  const Sequence original = opened_flight(
      folder / "flight", test::make_flight(),
      "pose_convention: body_to_world\nT_body_camera: [0,0,1,0.1, -1,0,0,0.2, 0,-1,0,0.3, 0,0,0,1]\n"
      "time_offset_s: 0.05\n");
  record(original, folder / "flight.bag");
  const auto read = Sequence::open(folder / "flight.bag");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(read->poses_of_body());
  ASSERT_EQ(read->size(), original.size());
  for (std::size_t i = 0; i < read->size(); ++i) {
    EXPECT_LT((read->pose(i).translation - original.pose(i).translation).norm(), 1e-12);
    EXPECT_LT(test::rotation_difference(read->pose(i), original.pose(i)), 1e-7);
  }
}

TEST(RecordedFlight, HasItsSensors) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  const NavigationLog log = some_sensors(flight.times[0]);
  const Sequence original = opened_flight(folder / "flight", flight);
  for (const char* const name : {"flight.bag", "flight.mcap"}) {
    record(original, folder / name, &log);
    const auto read = read_navigation_log(folder / name);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->imu.size(), log.imu.size());
    ASSERT_EQ(read->gnss.fixes.size(), log.gnss.fixes.size());
    ASSERT_EQ(read->gnss.velocities.size(), log.gnss.velocities.size());
    ASSERT_EQ(read->magnetometer.size(), log.magnetometer.size());
    ASSERT_EQ(read->barometer.size(), log.barometer.size());
    ASSERT_TRUE(read->gnss.lever_arm);
    EXPECT_EQ(*read->gnss.lever_arm, *log.gnss.lever_arm);
    for (std::size_t i = 0; i < log.imu.size(); ++i) {
      EXPECT_EQ(read->imu[i].time, log.imu[i].time);
      EXPECT_EQ(read->imu[i].angular_rate, log.imu[i].angular_rate);
      EXPECT_EQ(read->imu[i].specific_force, log.imu[i].specific_force);
    }
    for (std::size_t i = 0; i < log.gnss.fixes.size(); ++i) {
      EXPECT_LT((read->gnss.fixes[i].position - log.gnss.fixes[i].position).norm(), 1e-6);
      EXPECT_TRUE(read->gnss.fixes[i].covariance.isApprox(log.gnss.fixes[i].covariance));
      EXPECT_EQ(read->gnss.velocities[i].velocity, log.gnss.velocities[i].velocity);
      EXPECT_NEAR(read->barometer[i].height, log.barometer[i].height, 1e-6);
      EXPECT_LT((read->magnetometer[i].field - log.magnetometer[i].field).norm(), 1e-12);
    }
  }
}

TEST(RecordedFlight, WithoutSensorsSaysWhichIsMissing) {
  const test::TemporaryFolder folder;
  record(opened_flight(folder / "flight", test::make_flight()), folder / "flight.bag");
  const auto log = read_navigation_log(folder / "flight.bag");
  ASSERT_FALSE(log);
  EXPECT_THAT(log.error().message, HasSubstr("the IMU is missing"));
}

TEST(RecordedFlight, AsksWhichTopicIsMeant) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  OwnRecording own(folder / "two.mcap");
  own.camera("/left/image_raw", flight, "camera");
  own.camera("/right/image_raw", flight, "camera");
  for (std::size_t i = 0; i < flight.size(); ++i) {
    own.write(
        "/odom", "nav_msgs/Odometry", flight.times[i],
        write_odometry({flight.times[i], "map"}, "camera", flight.T_world_camera[i], own.writer->encoding()));
  }
  ASSERT_TRUE(own.writer->finish());
  const auto refused = Sequence::open(folder / "two.mcap");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("found 2 topics with images"));
  EXPECT_THAT(refused.error().message, HasSubstr("/left/image_raw (sensor_msgs/Image, 6), /right/image_raw"));
  SequenceOptions options;
  options.topics = "/right/image_raw";
  const auto right = Sequence::open(folder / "two.mcap", options);
  EXPECT_TRUE(right) << right.error().message;
  options.topics = "/up/image_raw";
  const auto unknown = Sequence::open(folder / "two.mcap", options);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("found no topic \"/up/image_raw\""));
}

TEST(RecordedFlight, PosesComeFromAChainOfTransforms) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  const Pose T_base_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.1, 0, 0.2}};
  const Pose T_map_odom{rotation_exp({0, 0, 0.5}), {10, 20, 0}};
  for (const char* const name : {"tf.bag", "tf.mcap"}) {
    OwnRecording own(folder / name);
    const auto encoding = own.writer->encoding();
    own.camera("/image", flight, "/optical");
    own.write("/tf_static", "tf2_msgs/TFMessage", flight.times[0],
              write_transform({flight.times[0], "base"}, "optical", T_base_camera, encoding));
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const Pose T_odom_base = T_map_odom.inverse() * flight.T_world_camera[i] * T_base_camera.inverse();
      own.write("/tf", "tf2_msgs/TFMessage", flight.times[i],
                write_transform({flight.times[i], "odom"}, "base", T_odom_base, encoding));
      Pose moving = T_map_odom;
      moving.translation.z() = 1e-9 * static_cast<double>(i);  // it is corrected now and then
      own.write("/tf", "tf2_msgs/TFMessage", flight.times[i],
                write_transform({flight.times[i], "map"}, "odom", moving, encoding));
    }
    ASSERT_TRUE(own.writer->finish());
    const auto read = Sequence::open(folder / name);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), flight.size());
    for (std::size_t i = 0; i < flight.size(); ++i) {
      EXPECT_LT((read->pose(i).translation - flight.T_world_camera[i].translation).norm(), 1e-7);
      EXPECT_LT(test::rotation_difference(read->pose(i), flight.T_world_camera[i]), 1e-7);
    }
  }
}

TEST(RecordedFlight, APoseOfTheBodyNeedsTheMountingOfTheCamera) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  OwnRecording own(folder / "odom.bag");
  own.camera("/image", flight, "optical");
  for (std::size_t i = 0; i < flight.size(); ++i) {
    own.write(
        "/odom", "nav_msgs/Odometry", flight.times[i],
        write_odometry({flight.times[i], "map"}, "base", flight.T_world_camera[i], MessageEncoding::ros1));
  }
  ASSERT_TRUE(own.writer->finish());
  const auto refused = Sequence::open(folder / "odom.bag");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message,
              HasSubstr("no transform says how the camera (\"optical\") sits on it"));
  SequenceOptions options;
  options.calibration = folder / "mounting.yaml";
  test::write_text(options.calibration, "T_body_camera: [0,0,1,0, -1,0,0,0, 0,-1,0,0, 0,0,0,1]\n");
  const auto read = Sequence::open(folder / "odom.bag", options);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->poses_of_body());
}

TEST(Bag, HasNoRecordAtTimeZeroWhichRosbagDoesNotPlay) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "zero.bag";
  auto writer = create_recording(file, Overwrite::refuse);
  ASSERT_TRUE(writer) << writer.error().message;
  for (const Time time : {Time{0}, Time{5}}) {
    const MessageHeader header{time, "map"};
    ASSERT_TRUE((*writer)->write("/pressure", "sensor_msgs/FluidPressure", time,
                                 write_pressure(header, 1e5, MessageEncoding::ros1)));
  }
  ASSERT_TRUE((*writer)->finish());
  const auto recording = Recording::open(file);
  ASSERT_TRUE(recording) << recording.error().message;
  const auto& messages = recording->topics().at(0).messages;
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].time, Time{1});
  EXPECT_EQ(messages[1].time, Time{5});
}

TEST(RecordedImages, EveryEncodingIsUnderstood) {
  const std::string bytes = {10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120};
  const auto pixel = [&](const char* encoding, std::uint32_t width, std::uint32_t step) -> Result<cv::Mat> {
    ImageMessage image;
    image.height = 12 / step;
    image.width = width;
    image.step = step;
    image.encoding = encoding;
    image.data = bytes;
    return pixels_of(image);
  };
  EXPECT_EQ(pixel("mono8", 2, 3)->at<std::uint8_t>(1, 1), 50);  // a row may have more bytes than pixels
  EXPECT_EQ(pixel("rgb8", 1, 6)->at<cv::Vec3b>(1, 0), cv::Vec3b(90, 80, 70));
  EXPECT_EQ(pixel("bgr8", 1, 6)->at<cv::Vec3b>(1, 0), cv::Vec3b(70, 80, 90));
  EXPECT_EQ(pixel("rgba8", 1, 4)->at<cv::Vec3b>(2, 0), cv::Vec3b(110, 100, 90));
  EXPECT_EQ(pixel("mono16", 1, 4)->at<std::uint16_t>(0, 0), 20 * 256 + 10);
  ASSERT_FALSE(pixel("mono8", 4, 3));
  const auto unknown = pixel("32FC1", 1, 4);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("found the encoding \"32FC1\""));
}

/// Reads all that is in a recording; whether anything was refused or left out.
bool is_known_to_be_damaged(const fs::path& file, std::size_t images) {
  const auto recording = Recording::open(file);
  if (!recording) return true;
  if (!recording->remarks().empty()) return true;
  const auto sequence = Sequence::open(file);
  if (!sequence) return true;
  std::size_t good = 0;
  for (std::size_t i = 0; i < sequence->size(); ++i) good += sequence->frame(i) ? 1U : 0U;
  return good < images;
}

TEST(DamagedRecording, AnyChangedByteOfAnMcapFileIsFound) {
  const test::TemporaryFolder folder;
  test::Flight flight = test::make_flight(2);
  record(opened_flight(folder / "flight", flight), folder / "whole.mcap");
  const std::string whole = test::read_bytes(folder / "whole.mcap");
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = whole;
    const std::size_t at = random() % bytes.size();
    bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1 + random() % 255));
    test::write_text(folder / "damaged.mcap", bytes);
    const auto recording = Recording::open(folder / "damaged.mcap");
    EXPECT_FALSE(recording) << "byte " << at << " of " << bytes.size();
    if (recording || at < 8) continue;
    EXPECT_THAT(recording.error().message, HasSubstr("byte"));
  }
}

TEST(DamagedRecording, IsRefusedOrReadWithoutHarm) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight(3);
  const NavigationLog log = some_sensors(flight.times[0]);
  const Sequence original = opened_flight(folder / "flight", flight);
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1));
  };
  for (const char* const name : {"flight.bag", "flight.mcap"}) {
    record(original, folder / name, &log);
    const std::string whole = test::read_bytes(folder / name);
    for (int i = 0; i < 400; ++i) {
      std::string bytes = whole;
      for (std::size_t j = below(4) + 1; j > 0 && !bytes.empty(); --j) {
        const std::size_t at = below(bytes.size());
        switch (below(5)) {
          case 0:
            bytes.erase(at, below(100));
            break;
          case 1:
            bytes.insert(at, bytes.substr(below(bytes.size()), below(200)));
            break;
          case 2:
            bytes.resize(at);
            break;
          default:
            bytes[at] = static_cast<char>(below(256));
            break;
        }
      }
      test::write_text(folder / "damaged", bytes);
      (void)is_known_to_be_damaged(folder / "damaged", flight.size());
      const auto sensors = read_navigation_log(folder / "damaged");
      if (!sensors) continue;
      for (const ImuSample& sample : sensors->imu) EXPECT_TRUE(sample.angular_rate.allFinite());
      for (const GnssFix& fix : sensors->gnss.fixes) EXPECT_TRUE(fix.position.allFinite());
    }
  }
}

TEST(DamagedRecording, OneThatIsCutOffIsReadAsFarAsItGoes) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight(40);  // several chunks
  const Sequence original = opened_flight(folder / "flight", flight);
  NavigationLog log = some_sensors(flight.times[0]);
  while (log.imu.size() < 8000) {
    ImuSample sample;
    sample.time.nanoseconds = log.imu.back().time.nanoseconds + 1'000'000;
    log.imu.push_back(sample);
  }
  for (const char* const name : {"flight.bag", "flight.mcap"}) {
    record(original, folder / name, &log);
    const std::string whole = test::read_bytes(folder / name);
    std::size_t most = 0;
    for (const double share : {0.5, 0.7, 0.9, 0.99}) {
      test::write_text(folder / "cut",
                       whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
      const auto recording = Recording::open(folder / "cut");
      ASSERT_TRUE(recording) << recording.error().message;
      ASSERT_FALSE(recording->remarks().empty());
      EXPECT_THAT(recording->remarks()[0], HasSubstr("cut off"));
      std::size_t count = 0;
      for (const Topic& topic : recording->topics()) count += topic.messages.size();
      EXPECT_GE(count, most);
      most = count;
    }
    EXPECT_GT(most, 4000U) << name;
  }
}

std::map<std::string, std::size_t> counts_of(const Recording& recording) {
  std::map<std::string, std::size_t> counts;
  for (const Topic& topic : recording.topics()) counts[topic.name + " " + topic.type] = topic.messages.size();
  return counts;
}

TEST(RecordingsOfOthers, HaveWhatOtherReadersFind) {
  const fs::path folder = fs::path(PADE_SOURCE_DIR) / "../shared/data/recordings";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  // As @foxglove/rosbag and @mcap/core count them.
  const std::map<std::string, std::size_t> turtles = {{"/rosout rosgraph_msgs/Log", 10},
                                                      {"/tf tf/tfMessage", 2688},
                                                      {"/tf_static tf2_msgs/TFMessage", 1},
                                                      {"/turtle1/cmd_vel geometry_msgs/Twist", 357},
                                                      {"/turtle1/color_sensor turtlesim/Color", 1351},
                                                      {"/turtle1/pose turtlesim/Pose", 1344},
                                                      {"/turtle2/cmd_vel geometry_msgs/Twist", 208},
                                                      {"/turtle2/color_sensor turtlesim/Color", 1344},
                                                      {"/turtle2/pose turtlesim/Pose", 1344}};
  const std::map<std::string, std::map<std::string, std::size_t>> expected = {
      {"example_tf.bag", turtles},
      {"example_bz2.bag", turtles},
      {"embag_lz4.bag",
       {{"/base_pose_ground_truth nav_msgs/Odometry", 5},
        {"/base_scan sensor_msgs/LaserScan", 5},
        {"/luminar_pointcloud sensor_msgs/PointCloud2", 5}}},
      {"rosbag2_cdr.mcap", {{"/test_topic test_msgs/BasicTypes", 3}, {"/array_topic test_msgs/Arrays", 4}}},
      {"lb_custom-camera-model.mcap",
       {{"/image/compressed foxglove.CompressedImage", 10},
        {"/camera_calibration foxglove.CameraCalibration", 10},
        {"/camera_calibration/custom foxglove.CameraCalibration", 10}}}};
  for (const auto& [file, counts] : expected) {
    const auto recording = Recording::open(folder / file);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(counts_of(*recording), counts) << file;
    EXPECT_TRUE(recording->remarks().empty()) << file;
  }
}

#ifdef PADE_HAS_SQLITE
TEST(RecordedFlight, IsTheSameInADatabaseOfRosbag2) {
  const test::TemporaryFolder folder;
  const Sequence original = opened_flight(folder / "flight", test::make_flight());
  record(original, folder / "flight.mcap");
  const auto mcap = Recording::open(folder / "flight.mcap");
  fs::create_directories(folder / "rosbag2");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "rosbag2/flight_0.db3").c_str(), &database), SQLITE_OK);
  sqlite3_exec(
      database,
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
      "offered_qos_profiles TEXT); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp "
      "INTEGER, data BLOB)",
      nullptr, nullptr, nullptr);
  const auto run = [&](const std::string& text, const std::string& blob) {
    sqlite3_stmt* statement = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(database, text.c_str(), -1, &statement, nullptr), SQLITE_OK);
    if (!blob.empty()) sqlite3_bind_blob(statement, 1, blob.data(), static_cast<int>(blob.size()), nullptr);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_DONE);
    sqlite3_finalize(statement);
  };
  int id = 0;
  for (const Topic& topic : mcap->topics()) {
    std::string type = topic.type;
    type.insert(type.find('/'), "/msg");
    run(fmt::format("INSERT INTO topics VALUES({}, '{}', '{}', 'cdr', '')", ++id, topic.name, type), {});
    for (const MessagePlace& place : topic.messages) {
      run(fmt::format("INSERT INTO messages(topic_id, timestamp, data) VALUES({}, {}, ?)", id,
                      place.time.nanoseconds),
          *mcap->read(place));
    }
  }
  sqlite3_close(database);
  test::write_text(folder / "rosbag2/metadata.yaml", "rosbag2_bagfile_information:\n");
  for (const char* const name : {"rosbag2", "rosbag2/flight_0.db3"}) {
    const auto read = Sequence::open(folder / name);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->layout(), "rosbag2");
    expect_same_flight(original, *read);
  }
  // One that is cut off is damaged.
  const std::string bytes = test::read_bytes(folder / "rosbag2/flight_0.db3");
  test::write_text(folder / "cut.db3", bytes.substr(0, bytes.size() / 2));
  EXPECT_TRUE(is_known_to_be_damaged(folder / "cut.db3", original.size()));
}
#endif

}  // namespace
}  // namespace pade::io
