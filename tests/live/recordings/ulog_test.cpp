// PX4's logs: one put together here byte by byte, real ones, and both damaged.
#include "pade/live/recordings/ulog.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kRecordings = fs::path(PADE_SOURCE_DIR) / "../shared/data/recordings";

/// A log in the making.
class UlogBytes {
 public:
  UlogBytes() : text_("ULog\x01\x12\x35\x01") { text_ += std::string(8, '\0'); }
  void add(char type, const std::string& content) {
    const auto size = static_cast<std::uint16_t>(content.size());
    text_ += of(size);
    text_ += type;
    text_ += content;
  }
  template <class T>
  static std::string of(T value) {
    return {reinterpret_cast<const char*>(&value), sizeof(T)};
  }
  template <class... Parts>
  static std::string joined(const Parts&... parts) {
    std::string all;
    (all.append(parts), ...);
    return all;
  }
  void add_imu() {
    add('F', "vector:float[2] xy;double z;");
    add('F',
        "sensor_combined:uint64_t timestamp;vector inner;float[3] gyro_rad;int8_t odd;"
        "float[3] accelerometer_m_s2;uint8_t[7] _padding0;");
    add('A', joined(of<std::uint8_t>(0), of<std::uint16_t>(513), "sensor_combined"));
    for (int i = 0; i < 100; ++i) {
      add('D', joined(of<std::uint16_t>(513), of<std::uint64_t>(5'000'000 + 4000 * i), std::string(16, 'x'),
                      of(0.1F), of(0.2F), of(0.3F), of<std::int8_t>(-3), of(1.0F), of(2.0F), of(-9.0F)));
    }
  }
  void add_gps_format() {
    add('F',
        "sensor_gps:uint64_t timestamp;uint64_t timestamp_sample;double latitude_deg;double longitude_deg;"
        "double altitude_msl_m;float eph;float epv;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;"
        "float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid;");
  }
  void add_gps() {
    add('A', joined(of<std::uint8_t>(0), of<std::uint16_t>(7), "sensor_gps"));
    for (int i = 0; i < 3; ++i) {
      add('D', joined(of<std::uint16_t>(7), of<std::uint64_t>(5'100'000 + 200'000 * i),
                      of<std::uint64_t>(5'000'000 + 200'000 * i), of(47.0), of(8.0), of(400.0 + i), of(0.5F),
                      of(0.8F), of(0.1F), of(1.0F), of(2.0F), of(-3.0F), of<std::uint8_t>(3),
                      of<std::uint8_t>(1)));
    }
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

fs::path stored(const test::TemporaryFolder& folder, const std::string& text) {
  fs::path file = folder / "log.ulg";
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

TEST(Ulog, FieldsLieWhereTheFormatsOfTheFileSayItself) {
  UlogBytes bytes;
  bytes.add_imu();
  const auto log = Ulog::parse(bytes.text(), "log.ulg");
  ASSERT_TRUE(log) << log.error().message;
  const auto* const topic = log->find("sensor_combined");
  ASSERT_NE(topic, nullptr);
  ASSERT_EQ(topic->rows.size(), 100U);
  EXPECT_EQ(log->column(*topic, "timestamp")->at(1), 5'004'000);
  EXPECT_FLOAT_EQ(static_cast<float>(log->column(*topic, "gyro_rad[1]")->at(5)), 0.2F);
  EXPECT_EQ(log->column(*topic, "odd")->at(5), -3);
  EXPECT_EQ(log->column(*topic, "accelerometer_m_s2[2]")->at(99), -9);
  EXPECT_TRUE(std::isnan(log->column(*topic, "_padding0[0]")->at(0)));  // left out at the end of a row
  for (const char* const none :
       {"gyro_rad", "gyro_rad[3]", "odd[0]", "none", "inner", "gyro_rad[x]", "gyro_rad["}) {
    EXPECT_FALSE(log->column(*topic, none)) << none;
  }
}

TEST(Ulog, TopicsBecomeMeasurementsInOurFrames) {
  UlogBytes bytes;
  bytes.add_gps_format();
  bytes.add_imu();
  bytes.add_gps();
  const test::TemporaryFolder folder;
  const auto log = read_ulog_sensors(stored(folder, bytes.text()));
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_EQ(log->imu.size(), 100U);
  EXPECT_TRUE(log->imu[0].specific_force.isApprox(Eigen::Vector3d(1, -2, 9), 1e-6));
  EXPECT_TRUE(log->imu[0].angular_rate.isApprox(Eigen::Vector3d(0.1, -0.2, -0.3), 1e-6));
  EXPECT_EQ(log->imu[1].time, (Time{5'004'000'000}));
  ASSERT_EQ(log->gnss.fixes.size(), 3U);
  EXPECT_EQ(log->gnss.fixes[1].time, (Time{5'200'000'000}));  // when it was measured
  EXPECT_NEAR(log->gnss.fixes[2].position.z(), 2, 1e-9);
  EXPECT_NEAR(log->gnss.fixes[2].covariance(0, 0), 0.25, 1e-6);
  EXPECT_TRUE(log->gnss.velocities[0].velocity.isApprox(Eigen::Vector3d(2, 1, 3), 1e-6));
  EXPECT_NEAR(log->gnss.velocities[0].covariance(2, 2), 0.01, 1e-6);
}

TEST(Ulog, WhatIsMissingIsNamed) {
  const test::TemporaryFolder folder;
  UlogBytes bytes;
  EXPECT_THAT(read_ulog_sensors(stored(folder, bytes.text())).error().message,
              HasSubstr("the IMU is missing"));
  bytes.add_imu();
  EXPECT_THAT(read_ulog_sensors(stored(folder, bytes.text())).error().message,
              HasSubstr("the GNSS is missing"));
  EXPECT_THAT(Ulog::parse("ULoc and more than sixteen bytes", "log.ulg").error().message,
              HasSubstr("log.ulg: found no log of PX4"));
}

TEST(Ulog, FeaturesThatMustBeUnderstoodAreRefusedAndACutIsSaid) {
  UlogBytes appended;
  appended.add('B', std::string(8, '\0') + '\x01' + std::string(31, '\0'));
  appended.add_imu();
  EXPECT_TRUE(Ulog::parse(appended.text(), "log.ulg"));
  UlogBytes newer;
  newer.add('B', std::string(8, '\0') + '\x02' + std::string(31, '\0'));
  EXPECT_THAT(Ulog::parse(newer.text(), "log.ulg").error().message,
              HasSubstr("features that are not understood"));
  UlogBytes circle;
  circle.add('F', "a:b x;");
  circle.add('F', "b:a y;uint64_t timestamp;");
  circle.add('A', std::string(1, '\0') + UlogBytes::of<std::uint16_t>(1) + "b");
  circle.add('D', UlogBytes::of<std::uint16_t>(1) + std::string(20, 'x'));
  const auto round = Ulog::parse(circle.text(), "log.ulg");
  ASSERT_TRUE(round);
  EXPECT_FALSE(round->column(*round->find("b"), "timestamp"));
  const std::string text = appended.text();
  const auto cut = Ulog::parse(text.substr(0, text.size() - 5), "log.ulg");
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->find("sensor_combined")->rows.size(), 99U);
  ASSERT_EQ(cut->remarks().size(), 1U);
}

std::size_t rows_of(const Ulog& log) {
  std::size_t count = 0;
  for (const Ulog::Topic& topic : log.topics()) count += topic.rows.size();
  return count;
}

/// Letters and sizes of messages, at the beginning of each.
std::vector<std::size_t> heads_of(const std::string& text) {
  std::vector<std::size_t> heads;
  for (std::size_t at = 16; at + 3 <= text.size();) {
    heads.push_back(at);
    std::uint16_t size = 0;
    std::memcpy(&size, text.data() + at, 2);
    at += 3U + size;
  }
  return heads;
}

TEST(Ulog, AFlippedBitCostsTheMessageThatItIsInAndIsSaid) {
  UlogBytes bytes;
  bytes.add_gps_format();
  bytes.add_imu();
  bytes.add('L', "6" + std::string(8, 't') + "[commander] Armed by external command");
  bytes.add_gps();
  bytes.add('S', "\x2F\x73\x13\x20\x25\x0C\xBB\x12");
  bytes.add('P', std::string("\x0f") + "float BAT_V_DIV" + UlogBytes::of(10.1F));
  const std::string whole = bytes.text();
  const auto intact = Ulog::parse(whole, "log.ulg");
  ASSERT_TRUE(intact);
  EXPECT_TRUE(intact->remarks().empty());
  const std::size_t rows = rows_of(*intact);
  ASSERT_EQ(rows, 103U);
  for (const std::size_t head : heads_of(whole)) {
    const bool row = whole[head + 2] == 'D';
    const bool other = whole[head + 2] == 'L' || whole[head + 2] == 'S' || whole[head + 2] == 'P';
    if (!row && !other) continue;  // the others are needed by all rows of their topic
    for (std::size_t bit = 0; bit < 24; ++bit) {
      std::string text = whole;
      text[head + bit / 8] = static_cast<char>(text[head + bit / 8] ^ (1 << bit % 8));
      const auto log = Ulog::parse(text, "log.ulg");
      ASSERT_TRUE(log) << log.error().message;
      EXPECT_GE(rows_of(*log) + (row ? 1 : 0), rows) << "bit " << bit << " of the head at " << head;
      ASSERT_FALSE(log->remarks().empty()) << "bit " << bit << " of the head at " << head;
      EXPECT_THAT(log->remarks()[0],
                  testing::AnyOf(HasSubstr(fmt::format("byte {}: damaged, ", head)), HasSubstr("the last ")));
    }
  }
}

TEST(Ulog, ADamagedTopicLeavesTheOthersWhole) {
  UlogBytes bytes;
  bytes.add_gps_format();
  bytes.add_imu();
  bytes.add_gps();
  std::string text = bytes.text();
  // Rows of a number that no topic has, at each of its places.
  text[text.find(std::string("\x01\x02") + "sensor_combined") + 1] = '\x03';
  const auto log = Ulog::parse(text, "log.ulg");
  ASSERT_TRUE(log);
  EXPECT_EQ(log->find("sensor_combined"), nullptr);
  ASSERT_NE(log->find("sensor_gps"), nullptr);
  EXPECT_EQ(log->find("sensor_gps")->rows.size(), 3U);
  const test::TemporaryFolder folder;
  EXPECT_THAT(read_ulog_sensors(stored(folder, text)).error().message,
              testing::AllOf(HasSubstr("the IMU is missing"), HasSubstr("damaged")));
  // A format that a bit has made another letter does not ask for features.
  std::string letter = bytes.text();
  letter[18] = 'B';
  EXPECT_TRUE(Ulog::parse(letter, "log.ulg"));
}

TEST(Ulog, WhatWasAppendedToALogThatEndsWithinAMessageIsFound) {
  UlogBytes first, more;
  first.add('B', std::string(8, '\0') + '\x01' + std::string(31, '\0'));
  first.add_imu();
  std::string text = first.text();
  text.resize(text.size() - 20);
  const std::uint64_t end = text.size();
  std::memcpy(text.data() + 19 + 16, &end, 8);
  for (int i = 0; i < 3; ++i) more.add('P', std::string("\x0f") + "float BAT_V_DIV" + UlogBytes::of(10.1F));
  text += more.text().substr(16);
  const auto log = Ulog::parse(text, "log.ulg");
  ASSERT_TRUE(log);
  EXPECT_EQ(log->find("sensor_combined")->rows.size(), 99U);
  ASSERT_EQ(log->remarks().size(), 1U);
  EXPECT_THAT(log->remarks()[0], HasSubstr("damaged, 34 bytes passed over"));
}

TEST(Ulog, DamagedBytesNeverCrash) {
  UlogBytes bytes;
  bytes.add_gps_format();
  bytes.add_imu();
  bytes.add_gps();
  const test::TemporaryFolder folder;
  std::mt19937 random(3);
  for (int round = 0; round < 150; ++round) {
    std::string text = bytes.text();
    for (int i = 0; i < 20; ++i) text[16 + random() % (text.size() - 16)] = static_cast<char>(random());
    const auto log = read_ulog_sensors(stored(folder, text));
    if (!log) continue;
    for (const ImuSample& sample : log->imu) ASSERT_TRUE(sample.specific_force.allFinite());
  }
}

struct RealLog {
  const char* file;
  std::size_t imu, gnss, magnetometer, barometer;  // counted by another reader
};

class UlogRecording : public testing::TestWithParam<RealLog> {};

/// Bits of sizes, letters and all else, each by itself.
TEST_P(UlogRecording, LosesNothingButWhatADamagedByteIsIn) {
  const RealLog& real = GetParam();
  if (!fs::exists(kRecordings / real.file)) GTEST_SKIP() << "the recording is not there";
  std::ifstream stream(kRecordings / real.file, std::ios::binary);
  std::stringstream content;
  content << stream.rdbuf();
  const std::string whole = content.str();
  const auto intact = Ulog::parse(whole, real.file);
  ASSERT_TRUE(intact) << intact.error().message;
  EXPECT_TRUE(intact->remarks().empty()) << intact->remarks()[0];
  const auto heads = heads_of(whole);
  const std::size_t rows = rows_of(*intact);
  std::mt19937 random(11);
  for (int i = 0; i < 20; ++i) {
    const std::size_t head = heads[random() % heads.size()];
    if (std::string_view("DLIP").find(whole[head + 2]) == std::string_view::npos) continue;
    std::string text = whole;
    const std::size_t bit = random() % 24;
    text[head + bit / 8] = static_cast<char>(text[head + bit / 8] ^ (1 << bit % 8));
    const auto log = Ulog::parse(text, real.file);
    ASSERT_TRUE(log) << log.error().message;
    EXPECT_GE(rows_of(*log) + 2, rows) << "bit " << bit << " of the head at " << head;
    EXPECT_FALSE(log->remarks().empty()) << "bit " << bit << " of the head at " << head;
  }
}

TEST_P(UlogRecording, HasTheSensorsThatWereCounted) {
  const RealLog& real = GetParam();
  if (!fs::exists(kRecordings / real.file)) GTEST_SKIP() << "the recording is not there";
  const auto log = read_ulog_sensors(kRecordings / real.file);
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_EQ(log->imu.size(), real.imu);
  EXPECT_EQ(log->gnss.fixes.size(), real.gnss);
  EXPECT_EQ(log->magnetometer.size(), real.magnetometer);
  EXPECT_EQ(log->barometer.size(), real.barometer);
  double force = 0;
  for (const ImuSample& sample : log->imu) force += sample.specific_force.z();
  EXPECT_NEAR(force / static_cast<double>(log->imu.size()), 9.8, 1.5);  // up is up
}

INSTANTIATE_TEST_SUITE_P(Real, UlogRecording,
                         testing::Values(RealLog{"sample_log_small.ulg", 1298, 32, 319, 120},
                                         RealLog{"sample_px4_events.ulg", 7783, 423, 459, 623},
                                         RealLog{"sample_logging_tagged_and_default_params.ulg", 2028, 30,
                                                 159, 202}));

/// Every number of the topics that we use, as another program reads it.
TEST(NodeUlog, ReadsTheSameNumbers) {
  const char* const modules = std::getenv("PADE_NODE_MODULES");
  if (modules == nullptr) GTEST_SKIP() << "PADE_NODE_MODULES is not set: run scripts/mavlink-oracle";
  const test::TemporaryFolder folder;
  if (!fs::exists(kRecordings)) GTEST_SKIP() << "the recordings are not there: " << kRecordings;
  for (const char* const file :
       {"sample_log_small.ulg", "sample_px4_events.ulg", "sample_logging_tagged_and_default_params.ulg"}) {
    std::ifstream stream(kRecordings / file, std::ios::binary);
    std::stringstream content;
    content << stream.rdbuf();
    const auto log = Ulog::parse(content.str(), file);
    ASSERT_TRUE(log) << log.error().message;
    std::ofstream stated(folder / "stated.jsonl");
    for (const auto& [name, fields] : std::map<std::string, std::vector<std::string>>{
             {"sensor_combined", {"timestamp", "gyro_rad[0]", "gyro_rad[2]", "accelerometer_m_s2[1]"}},
             {"vehicle_gps_position", {"timestamp", "eph", "vel_d_m_s", "fix_type", "vel_ned_valid"}},
             {"vehicle_magnetometer", {"timestamp", "magnetometer_ga[2]"}},
             {"vehicle_air_data", {"timestamp", "baro_alt_meter"}}}) {
      const auto* const topic = log->find(name);
      ASSERT_NE(topic, nullptr);
      for (const std::string& field : fields) {
        std::string values;
        const auto column = log->column(*topic, field);
        ASSERT_TRUE(column) << field;
        for (const double value : *column) {
          values += fmt::format("{}{:.17g}", values.empty() ? "" : ",", value);
        }
        stated << fmt::format("{{\"topic\":\"{}\",\"field\":\"{}\",\"values\":[{}]}}\n", name, field, values);
      }
    }
    stated.close();
    const std::string command =
        fmt::format("NODE_PATH='{}' node '{}/tests/live/recordings/node_ulog.js' '{}' '{}'", modules,
                    PADE_SOURCE_DIR, (kRecordings / file).string(), (folder / "stated.jsonl").string());
    EXPECT_EQ(std::system(command.c_str()), 0);
  }
}

}  // namespace
}  // namespace pade::live
